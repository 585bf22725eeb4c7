"""Whether a study has had enough rounds, and the next one where it has not."""

from __future__ import annotations

from dataclasses import replace

import pandas as pd

from sandmould.runs.columns import CPU_S, total_s
from sandmould.runs.formatting import listed, name_of, number, unit_of
from sandmould.statistics.emulator import TooFewRunsError
from sandmould.statistics.optimum import Optimum, find_optimum
from sandmould.statistics.propose import propose
from sandmould.study.definition.certificate import round_best_hz
from sandmould.study.definition.refinement import Refinement
from sandmould.study.definition.study import Study
from sandmould.study.definition.sweep import is_whole
from sandmould.study.rounds.round_log import Round, RoundLog


def next_runs(log: RoundLog, study: Study, summary: pd.DataFrame, keys: list[str]) -> RoundLog:
    """Add what comes next: a round, or, once they have ended, the controls of the optimum.

    Parameters
    ----------
    log : RoundLog
    study : Study
    summary : DataFrame
        One row a run of the sweep and of all rounds so far.
    keys : list of str
        Swept keys.
    """
    if study.refine.rounds:
        log = next_round(log, study, summary, keys)
    else:
        log = replace(log, ended="The sweep is done.")
    if not log.ended or not study.certificate.controls or log.certified_hz:
        return log
    try:
        return choose_controls(log, study, summary, keys)
    except TooFewRunsError as error:
        return replace(log, ended=f"No robustness checks: {error}.")


def next_round(log: RoundLog, study: Study, summary: pd.DataFrame, keys: list[str]) -> RoundLog:
    """Add a round, or the reason why there is none; parameters as in ``next_runs``."""
    refine, done = study.refine, len(log.rounds)
    spent_h = total_s(summary, CPU_S) / 3600 if CPU_S in summary else 0.0
    try:
        optimum = find_optimum(
            summary, keys, study.objective.measure, study.objective.better, seed=done
        )
    except TooFewRunsError as error:
        return replace(log, ended=f"Too few runs finished: {error}.")
    ended = why_enough(refine, optimum, done, spent_h, spent_h / max(len(summary), 1))
    if ended:
        return replace(log, ended=ended)
    whole = [key for key in keys if is_whole(type(study.scenario), key)]
    added = Round(
        tuple(propose(optimum, summary, refine.runs, done, whole)),
        optimum.setting,
        {key: optimum.interval(key) for key in keys},
        spent_h,
    )
    # Controls are of the optimum that was best then: with more runs they are chosen anew.
    return replace(log, rounds=(*log.rounds, added), ended="", certified_hz=())


def choose_controls(
    log: RoundLog, study: Study, summary: pd.DataFrame, keys: list[str]
) -> RoundLog:
    """Choose the frequencies of the controls: the best, one below and one above.

    Raises
    ------
    TooFewRunsError
    """
    objective = study.objective
    optimum = find_optimum(summary, keys, objective.measure, objective.better)
    best_hz = optimum.setting[keys[0]]
    return replace(log, certified_hz=round_best_hz(best_hz, study.certificate.ratio))


def why_enough(
    refine: Refinement, optimum: Optimum, done: int, spent_h: float, run_h: float
) -> str:
    """Say why rounds end; empty where one more is due.

    Parameters
    ----------
    refine : Refinement
    optimum : Optimum
    done : int
        Rounds so far.
    spent_h, run_h : float, h
        Processor time of all runs so far, and of one on average.
    """
    wide = [key for key, width in refine.interval.items() if _width(optimum, key) > width]
    if refine.interval and not wide:
        return f"The optimum is as narrow as asked: {_intervals(optimum, list(refine.interval))}."
    if done >= refine.rounds:
        return "The one round is done." if refine.rounds == 1 else f"All {done} rounds are done."
    if refine.budget_core_h is not None and spent_h + refine.runs * run_h > refine.budget_core_h:
        return (
            f"Of {refine.budget_core_h:g} h of processor time {number(spent_h, 2)} h are spent, "
            f"and a round takes {number(refine.runs * run_h, 2)} h."
        )
    return ""


def _width(optimum: Optimum, key: str) -> float:
    low, high = optimum.interval(key)
    return high - low


def _intervals(optimum: Optimum, keys: list[str]) -> str:
    said = []
    for key in keys:
        low, high = optimum.interval(key)
        said.append(f"{name_of(key)} {number(low)} to {number(high)} {unit_of(key)}".rstrip())
    return listed(said)


def decision_text(log: RoundLog, study: Study) -> str:
    """One line on the last decision, for the terminal."""
    if log.ended and log.certified_hz:
        frequencies = listed([number(f) for f in log.certified_hz])
        controls = listed([c.replace("_", " ") for c in study.certificate.controls], most=8)
        return f"{log.ended} The controls of the optimum at {frequencies} Hz: {controls}."
    if log.ended:
        return log.ended
    last = log.rounds[-1]
    where = listed(
        [
            f"{name_of(key)} {number(value)} ({number(last.interval[key][0])} to "
            f"{number(last.interval[key][1])}) {unit_of(key)}".rstrip()
            for key, value in last.setting.items()
        ]
    )
    fresh = sum(replicate == 1 for _, replicate in last.runs)
    return (
        f"Round {len(log.rounds)} of at most {study.refine.rounds}: best so far is {where}; "
        f"{fresh} new points and {len(last.runs) - fresh} more replicates."
    )
