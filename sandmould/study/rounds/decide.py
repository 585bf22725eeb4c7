"""Whether a study has had enough rounds, and the next one where it has not."""

from __future__ import annotations

from dataclasses import replace

import pandas as pd

from sandmould.definition.certificate import round_best_hz
from sandmould.definition.refinement import Refinement
from sandmould.definition.study import Study
from sandmould.definition.sweep import is_whole, points
from sandmould.runs.columns import CPU_S, REPLICATE, total_s
from sandmould.runs.formatting import listed, name_of, number, setting_text, unit_of
from sandmould.runs.templates import worded
from sandmould.statistics.emulator import TooFewRunsError
from sandmould.statistics.optimum import Optimum, find_optimum, propose
from sandmould.study.rounds.contenders import best_points, find_contenders, why_decided
from sandmould.study.rounds.round_log import Round, RoundLog


def next_runs(log: RoundLog, study: Study, summary: pd.DataFrame, keys: list[str]) -> RoundLog:
    """Add what comes next: a round, or, once they have ended, the controls of the optimum."""
    # Runs of the controls lie beyond the sweep: they must not open what has ended, or all
    # controls are computed again round another optimum.
    of_rounds = _of_rounds(log, study, summary, keys)
    if study.refine.rounds:
        of_kind = next_round if study.refine.adds == "points" else next_replicates
        log = of_kind(log, study, of_rounds, keys)
    else:
        log = replace(log, ended="The sweep is done.")
    if log.ended and study.grain_price_share:
        log = replace(log, coarsened=best_points(of_rounds, study, keys))
    if not log.ended or not study.certificate.controls or log.certified_hz:
        return log
    try:
        optimum = find_optimum(summary, keys, study.objective.measure, study.objective.better)
    except TooFewRunsError as error:
        return replace(log, ended=f"No robustness checks: {error}.")
    return replace(log, certified_hz=round_best_hz(optimum.setting[keys[0]]))


def next_round(log: RoundLog, study: Study, summary: pd.DataFrame, keys: list[str]) -> RoundLog:
    """Add a round, or the reason why there is none; parameters as in ``next_runs``."""
    refine, done, spent_h = study.refine, len(log.rounds), _spent_h(summary)
    try:
        optimum = find_optimum(
            summary, keys, study.objective.measure, study.objective.better, seed=done
        )
    except TooFewRunsError as error:
        return replace(log, ended=f"Too few runs finished: {error}.")
    run_h = spent_h / max(len(summary), 1)
    ended = why_narrow(refine, optimum) or why_over(refine, done, spent_h, refine.runs * run_h)
    if ended:
        return replace(log, ended=ended)
    whole = [key for key in keys if is_whole(type(study.scenario), key)]
    added = Round(
        tuple(propose(optimum, summary, refine.runs, done, whole)),
        optimum.setting,
        {key: optimum.interval(key) for key in keys},
        spent_h,
    )
    return _with_round(log, added)


def _with_round(log: RoundLog, added: Round) -> RoundLog:
    """With one round more: what is computed round the best setting is chosen anew after it."""
    return replace(log, rounds=(*log.rounds, added), ended="", certified_hz=(), coarsened=None)


def _of_rounds(log: RoundLog, study: Study, summary: pd.DataFrame, keys: list[str]) -> pd.DataFrame:
    """Rows of the sweep and its rounds, without those at frequencies of the controls alone."""
    if not log.certified_hz:
        return summary
    (key,) = keys
    every = range(1, study.replicates + 1)
    swept = points(study.sweep, study.scenario)
    mine = {(point[key], r) for point in swept for r in every}
    mine |= {(point[key], r) for point, r in log.runs}
    rows = zip(summary[key], summary[REPLICATE], strict=True)
    return summary[[row in mine for row in rows]]


def next_replicates(
    log: RoundLog, study: Study, summary: pd.DataFrame, keys: list[str]
) -> RoundLog:
    """Add replicates of the settings that may be the best; parameters as in ``next_runs``."""
    refine, done, spent_h = study.refine, len(log.rounds), _spent_h(summary)
    contenders = find_contenders(summary, study, keys)
    if contenders is None:
        return replace(log, ended="Too few runs finished to compare two settings.")
    runs = contenders.more(refine.runs)
    ended = why_decided(contenders, refine.half_width)
    ended = ended or why_over(refine, done, spent_h, len(runs) * spent_h / max(len(summary), 1))
    if ended:
        return replace(log, ended=ended)
    added = Round(runs, contenders.points[0], {}, spent_h)
    return _with_round(log, added)


def _spent_h(summary: pd.DataFrame) -> float:
    return total_s(summary, CPU_S) / 3600 if CPU_S in summary else 0.0


def why_narrow(refine: Refinement, optimum: Optimum) -> str:
    """Say that the optimum is as narrow as asked; empty where it is not."""
    wide = [key for key, width in refine.interval.items() if _width(optimum, key) > width]
    if not refine.interval or wide:
        return ""
    for key in refine.interval:
        if end := optimum.at_end(key):
            return (
                f"The optimum may lie beyond the {end} {name_of(key)} swept: no round inside the "
                "sweep narrows it."
            )
    return f"The optimum is as narrow as asked: {_intervals(optimum, list(refine.interval))}."


def why_over(refine: Refinement, done: int, spent_h: float, round_h: float) -> str:
    """Say that no further round is allowed; empty where one is.

    Parameters
    ----------
    spent_h, round_h : float, h
        Processor time of all runs so far, and of the next round.
    """
    if done >= refine.rounds:
        return "The one round is done." if refine.rounds == 1 else f"All {done} rounds are done."
    if refine.budget_core_h is not None and spent_h + round_h > refine.budget_core_h:
        return (
            f"Of {refine.budget_core_h:g} h of processor time {number(spent_h, 2)} h are spent, "
            f"and a round takes {number(round_h, 2)} h."
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
    last, best = log.rounds[-1] if log.rounds else None, ""
    if last and study.refine.adds == "replicates":
        best = setting_text(last.setting)
    elif last:
        best = listed(
            [
                f"{name_of(key)} {number(value)} ({number(last.interval[key][0])} to "
                f"{number(last.interval[key][1])}) {unit_of(key)}".rstrip()
                for key, value in last.setting.items()
            ]
        )
    return worded(
        "decision.j2",
        log=log,
        controls=[control.replace("_", " ") for control in study.certificate.controls],
        most=study.refine.rounds,
        adds=study.refine.adds,
        best=best,
        last=last,
        fresh=sum(replicate == 1 for _, replicate in last.runs) if last else 0,
    )
