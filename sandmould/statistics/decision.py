"""From tables to the answer of a study: the one place that decides what the runs say."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field, replace

import pandas as pd

from sandmould.runs.columns import RUN
from sandmould.runs.formatting import OF_BED, filled_space, is_number, setting_text
from sandmould.scenario.drive import BoxDrive
from sandmould.statistics.answer import (
    BENDING,
    CRUSHED,
    FARTHEST,
    OUTSIDE,
    TIP,
    Answer,
    Asked,
    Decided,
    SweepEnd,
)
from sandmould.statistics.config import Aim, Goal
from sandmould.statistics.evidence import (
    left_out_counts,
    one_way_runs,
    usable_values,
    why_no_value,
)
from sandmould.statistics.main_effects import has_trend
from sandmould.statistics.over_time import passage_of, reached_s
from sandmould.statistics.refining import Refining, refining_of, resolution_among
from sandmould.statistics.settings import Setting, measures_of, number_blocks, setting_rows
from sandmould.statistics.verdict import Verdict, compare_settings, further_replicates

_SAME = 1e-9
"""Values without chance that differ by less, as a share, are the same but for round-off."""


@dataclass(frozen=True)
class Evidence:
    """What an answer is decided from."""

    summary: pd.DataFrame
    """One row a run of the sweep."""
    curves: pd.DataFrame = field(default_factory=pd.DataFrame)
    """One row a snapshot."""
    drives: Mapping[str, BoxDrive] = field(default_factory=dict)
    """How the box moves, by label of the setting."""
    stand_ins: tuple[str, ...] = ()
    """Keys of values that are not what they stand for."""
    table_limit_at: Callable[[SweepEnd], str] = lambda end: ""
    """Key of the limit of the user's table that lies there; empty where it can go beyond."""


def decide(asked: Asked, evidence: Evidence) -> Answer:
    """Answer the question of a study, and say of every other cavity and pattern how it does."""
    answer = _decide_one(asked, evidence)
    if asked.better == "neither":
        return answer
    aims = aims_beside(asked.measure, asked.beside, evidence.summary)
    each = (replace(asked, measure=a.measure, better=a.better, goal=a.goal) for a in aims)
    beside = (_decide_one(one, evidence) for one in each)
    return replace(answer, beside=tuple(a for a in beside if a.used))


def aims_beside(measure: str, beside: Sequence[Aim], summary: pd.DataFrame) -> list[Aim]:
    """What settings are judged by besides a measure: what is asked, other cavities, a pattern."""
    aims = list(beside)
    told = {filled_space(each) for each in (measure, *(a.measure for a in aims))}
    shares = [str(column) for column in summary if str(column).endswith(OF_BED)]
    aims += [Aim(measure=share) for share in shares if filled_space(share) not in told]
    if TIP in summary and not any(measure.startswith("pattern_") for measure in told):
        aims.append(Aim(measure=TIP, better="smaller"))
    return aims


def _decide_one(asked: Asked, evidence: Evidence) -> Answer:
    summary = evidence.summary
    errors: dict[str, float] = {}
    fine = resolution_among(asked.keys)
    if fine and len(asked.keys) > 1 and not asked.by_lot:
        summary, errors = _finest(summary, asked, fine)
        asked = replace(asked, keys=tuple(k for k in asked.keys if k != fine))
    verdict = compare_settings(summary, asked.keys, asked.measure, asked.better)
    answer = Answer(
        asked, Decided.NO_RESULT, verdict,
        left_out=left_out_counts(evidence.summary, asked.measure),
        no_value=why_no_value(evidence.summary, asked.measure),
        one_way=one_way_runs(evidence.summary), planned=len(evidence.summary),
        drives=evidence.drives, stand_ins=evidence.stand_ins,
    )  # fmt: skip
    if not answer.used:
        return answer
    refining = _refining(verdict, asked.keys[0]) if asked.keys == (fine,) else None
    if refining is not None:
        return replace(answer, decided=Decided.FINEST, refining=refining)
    if len(answer.used) > 1 and _is_same(summary, asked, answer.used):
        is_run = _are_same_runs(summary, asked)
        if asked.better != "neither" and asked.goal and asked.goal.measure in summary:
            answer = _with_target(answer, asked.goal, evidence, summary)
        return replace(answer, decided=Decided.NO_EFFECT if is_run else Decided.EQUAL)
    if asked.better == "neither":
        if len(answer.used) > 1:
            return replace(answer, decided=Decided.RANGE)
        answer = replace(answer, decided=Decided.VALUE)
        bends = asked.measure in BENDING
        return _with_course(answer, evidence, summary, answer.used[0]) if bends else answer
    answer = _with_limits(answer, evidence, summary, errors)
    if asked.goal and asked.goal.measure in summary:
        answer = _with_target(answer, asked.goal, evidence, summary)
        if answer.shares:
            return answer
    return replace(answer, decided=_compared(answer))


def _compared(answer: Answer) -> Decided:
    """What is decided by means alone."""
    if len(answer.used) == 1:
        return Decided.VALUE
    if not _is_settled(answer):
        return Decided.OPEN
    return Decided.BEST_AT_END if answer.ends else Decided.BEST


def _is_settled(answer: Answer) -> bool:
    """Whether the best is told apart from all others, by chance or by the numerical error."""
    if answer.asked.by_lot:
        return answer.verdict.resolved
    return abs(answer.verdict.difference) > (answer.numerical_error or 0.0)


def _with_limits(
    answer: Answer, evidence: Evidence, summary: pd.DataFrame, errors: Mapping[str, float]
) -> Answer:
    """With the ends of the sweep, what further runs would do, and how the best one went on."""
    best, verdict = answer.best, answer.verdict
    assert best is not None
    ends = _ends(best, verdict, answer.asked.keys)
    known = [errors.get(s.label) for s in (best, verdict.runner_up) if s is not None]
    answer = replace(
        answer,
        ends=tuple(end for end in ends if not evidence.table_limit_at(end)),
        table_ends=tuple(end for end in ends if evidence.table_limit_at(end)),
        further_runs=further_replicates(verdict.comparisons, best),
        numerical_error=None if None in known else sum(e for e in known if e is not None),
    )
    return _with_course(answer, evidence, summary, best)


def _with_course(
    answer: Answer, evidence: Evidence, summary: pd.DataFrame, setting: Setting
) -> Answer:
    """With how a setting went on over its vibration, and where that left a pattern."""
    runs, measure = _runs(summary, answer.asked, setting), answer.asked.measure
    means, period_s = dict[str, float](), 0.0
    if measure in BENDING:
        drive = evidence.drives.get(setting.label)
        period_s = 1.0 / drive.frequency_hz if drive else 0.0
        rows = summary[summary[RUN].astype(str).isin(runs)]
        known = {name: rows[name].dropna() for name in (OUTSIDE, FARTHEST) if name in rows}
        means = {name: float(values.mean()) for name, values in known.items() if len(values)}
    return replace(
        answer,
        passage=passage_of(evidence.curves, runs, measure, period_s),
        outside=means.get(OUTSIDE),
        farthest_m=means.get(FARTHEST),
        crushed=_largest(evidence.curves, runs, CRUSHED) if measure in BENDING else 0.0,
    )


def _largest(curves: pd.DataFrame, runs: Sequence[str], measure: str) -> float:
    """Largest value of a measure in some runs; 0 where it was not taken."""
    if measure not in curves:
        return 0.0
    largest = curves.loc[curves[RUN].astype(str).isin(runs), measure].max()
    return 0.0 if pd.isna(largest) else float(largest)


def _with_target(answer: Answer, goal: Goal, evidence: Evidence, summary: pd.DataFrame) -> Answer:
    """Judge the settings by the target, absolutely before relatively."""
    better = answer.asked.better
    shares = {
        s.label: s for s in compare_settings(summary, answer.asked.keys, goal.measure).settings
        if s.n
    }  # fmt: skip
    sign = 1.0 if better == "larger" else -1.0
    reach = [
        s for s in answer.used
        if s.label in shares and sign * (shares[s.label].mean - goal.value) >= 0.0
    ]  # fmt: skip
    reach.sort(key=lambda s: _force(evidence.drives.get(s.label)))
    shown = [
        s for s in reach
        if not answer.asked.by_lot
        or sign * (shares[s.label].mean - goal.value) >= shares[s.label].ci_half_width
    ]  # fmt: skip
    sure = (shown or reach) if better == "larger" else []
    runs = {s.label: _runs(summary, answer.asked, s) for s in sure}
    curves, at = evidence.curves, (goal.measure, goal.value)
    times_s = {label: reached_s(curves, own, *at) for label, own in runs.items()}
    is_poured = bool(sure) and not any(times_s.values())
    told = [s for s in sure if not is_poured and math.isfinite(times_s[s.label])]
    shortest = min(told, key=lambda s: times_s[s.label], default=None)
    if shortest is not None and shortest is not sure[0]:
        # each of its runs before each of the gentlest setting's, or it may be chance
        slow, fast = ([reached_s(curves, [run], *at) for run in runs[s.label]]
                      for s in (shortest, sure[0]))  # fmt: skip
        shortest = shortest if max(slow) < min(fast) else None
    return replace(
        answer, shares=shares, reach=tuple(reach), shown=tuple(shown), shortest=shortest,
        shortest_s=times_s[shortest.label] if shortest else 0.0, poured=is_poured,
        decided=Decided.REACHED if reach else Decided.NONE_REACHES,
    )  # fmt: skip


def _force(drive: BoxDrive | None) -> tuple[float, float]:
    """What makes one shake gentler than another; without a drive the order of the sweep stays."""
    return (drive.acceleration_g, drive.velocity_m_s) if drive else (0.0, 0.0)


def _runs(summary: pd.DataFrame, asked: Asked, setting: Setting) -> list[str]:
    """Runs of a setting that count."""
    used = usable_values(summary, asked.measure).notna().to_numpy()
    for at, rows in setting_rows(summary, asked.keys):
        if at == setting.values:
            return [str(r) for r in summary[RUN].iloc[rows[used[rows]]]]
    return []


def _ends(best: Setting, verdict: Verdict, keys: Sequence[str]) -> tuple[SweepEnd, ...]:
    """Ends of swept numbers at which the best lies: the true best may lie beyond.

    Settings without a run that counts are among those that were swept. Where the best is not told
    from all others, a key counts if the measure goes one way with it, see ``has_trend``.
    """
    found, settings = [], verdict.settings
    for key in keys:
        values = [s.values[key] for s in settings]
        if not all(is_number(v) and math.isfinite(v) for v in values):
            continue
        if not verdict.resolved and not has_trend(verdict, key):
            continue
        mine, low, high = float(best.values[key]), min(values), max(values)
        # Below nothing there is no value to try.
        is_known = len({s.values[key] for s in settings if s.n}) > 1
        if is_known and mine in (low, high) and mine != 0.0:
            found.append(SweepEnd(key, mine, mine == high))
    return tuple(found)


def _refining(verdict: Verdict, key: str) -> Refining | None:
    return refining_of(key, [(float(s.values[key]), s.mean) for s in verdict.settings if s.n])


def _finest(
    summary: pd.DataFrame, asked: Asked, fine: str
) -> tuple[pd.DataFrame, dict[str, float]]:
    """The finest runs of each setting of the other keys, and what that leaves open there."""
    keys = [k for k in asked.keys if k != fine]
    rows, errors = [], {}
    for at, own in setting_rows(summary, keys):
        levels = summary.iloc[own]
        used = levels[usable_values(levels, asked.measure).notna()]
        chosen = used if len(used) else levels
        rows.append(chosen[chosen[fine] == chosen[fine].min()])
        refining = _refining(compare_settings(levels, [fine], asked.measure), fine)
        if refining is not None:
            errors[setting_text(at)] = refining.error
    return pd.concat(rows), errors


def _is_same(summary: pd.DataFrame, asked: Asked, used: Sequence[Setting]) -> bool:
    """Whether the measure is the same at every setting, replicate by replicate."""
    values = usable_values(summary, asked.measure)
    blocks = number_blocks(summary) if asked.by_lot else [0] * len(summary)
    spans = values.groupby(blocks).agg(["min", "max", "count"])
    spans = spans[spans["count"] > 0]
    if (spans["count"] < 2).any() or spans["count"].sum() <= len(spans) or len(used) < 2:
        return False
    most = 0.0 if asked.by_lot else _SAME * float(values.abs().max())
    return bool((spans["max"] - spans["min"] <= most).all())


def _are_same_runs(summary: pd.DataFrame, asked: Asked) -> bool:
    """Whether all that was measured is the same too."""
    measured = measures_of(summary, asked.keys)
    blocks = number_blocks(summary) if asked.by_lot else [0] * len(summary)
    groups = measured.groupby(blocks)
    spans = (groups.max() - groups.min()).fillna(0.0).to_numpy()
    most = 0.0 if asked.by_lot else _SAME * measured.abs().max().fillna(0.0).to_numpy()
    return bool((spans <= most).all())
