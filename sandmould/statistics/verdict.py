"""Which setting of a study is best, how sure that is, and what the answer leaves open."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Literal

import pandas as pd

from sandmould.runs.columns import RUN, finished
from sandmould.runs.formatting import (
    display_number,
    listed,
    name_of,
    number,
    setting_text,
    value_text,
    with_margin,
)
from sandmould.scenario.vibration import VibrationStage
from sandmould.statistics.contrasts import Spread
from sandmould.statistics.evidence import (
    bounded_values,
    error_text,
    loop_barred,
    loop_errors,
    one_way_caveat,
    reasons_sentence,
    shown_values,
)
from sandmould.statistics.settings import (
    Comparison,
    Setting,
    compare,
    number_blocks,
    setting_of,
    setting_rows,
)

Better = Literal["larger", "smaller", "neither"]
FEW = 3
"""Replicates from which on a setting's own interval tells something."""
MANY = 10
"""Runs of a setting from which on a difference that does not show is said to be small."""
MOST_NAMED = 100
"""More further runs are named nowhere: their estimate is as uncertain as the difference."""
NOT_TESTED = (
    "The robustness checks have not been run (springs, bed depth, grain size, time step). So it "
    "is not known whether the optimum belongs to the sand or to the model's springs."
)


@dataclass(frozen=True)
class Verdict:
    """The judgement of a study."""

    measure: str
    better: Better
    settings: tuple[Setting, ...]
    best: Setting | None
    runner_up: Setting | None
    difference: float
    """Mean of the best minus that of the runner-up; NaN without two settings."""
    ci: tuple[float, float]
    p: float
    resolved: bool
    comparisons: tuple[Comparison, ...]
    """The best against every other setting, nearest first."""
    sentences: tuple[str, ...]
    """Plain language; the first says at once when nothing is resolved."""
    caveats: tuple[str, ...]

    def against(self, setting: Setting) -> Comparison | None:
        """Comparison of the best with a setting."""
        return next((c for c in self.comparisons if c.other == setting.label), None)


def compare_settings(
    summary: pd.DataFrame,
    keys: Sequence[str],
    measure: str,
    better: Better = "larger",
    notes: Sequence[str] = (),
    seeks_best: bool = True,
    draws_by_lot: bool = True,
) -> Verdict:
    """Compare the settings of a study by the mean of the objective.

    Only runs that are evidence of the objective count, see ``evidence``. Settings are compared
    by the spread that all share, that of an analysis of variance, or by their own where it is
    larger. Replicates share their seeds across settings: what a replicate shifts in all of them
    drops out of their differences, see ``Spread.of``. Where settings have unlike replicates, these
    differences also rank them. The best is picked after seeing the data:
    intervals and p values hold for all pairs of settings together (Tukey 1953; Kramer 1956 for
    unlike numbers of replicates).

    Parameters
    ----------
    summary : DataFrame
        One row a run, from :func:`sandmould.study.collect.collect`.
    keys : sequence of str
        Swept keys; a setting is a combination of their values.
    measure : str
        Column of the objective.
    better : {"larger", "smaller", "neither"}
        Which values are better.
    notes : sequence of str
        Caveats that the caller knows of, put after those found here.
    seeks_best : bool
        Whether the study looks for the best setting, so that its place in the sweep matters.
    draws_by_lot : bool
        Whether runs of one setting differ by their seeds, so that few of them are a reason to
        doubt.
    """
    values = bounded_values(summary, measure)
    errors = loop_errors(summary, measure)[values.notna()].reindex(values.index)
    in_blocks = values.set_axis(number_blocks(summary))
    groups = [(at, len(rows), in_blocks.iloc[rows].dropna(), _mean_error(errors.iloc[rows]))
              for at, rows in setting_rows(summary, keys)]  # fmt: skip
    settings = tuple(setting_of(*group) for group in groups)
    of_setting = {s.label: group[2] for s, group in zip(settings, groups, strict=True)}
    ranked, comparisons = _ranked(settings, of_setting, better)
    best = ranked[0] if ranked else None
    first = comparisons[0] if comparisons else None
    resolved = first is not None and first.separated
    resolved = resolved and all(c.separated for c in comparisons if c.tested)
    caveats = [
        *_run_caveats(settings, summary, keys, measure, seeks_best, draws_by_lot),
        *(_edge_caveats(best, settings, keys, resolved) if seeks_best else ()),
        *_identical([c.other for c in comparisons if _is_identical(c, of_setting, best)]),
        *notes,
    ]
    return Verdict(
        measure=measure,
        better=better,
        settings=settings,
        best=best,
        runner_up=ranked[1] if len(ranked) > 1 else None,
        difference=first.difference if first else math.nan,
        ci=first.ci if first else (math.nan, math.nan),
        p=first.p if first else math.nan,
        resolved=resolved,
        comparisons=comparisons,
        sentences=_sentences(measure, better, settings, ranked, comparisons, resolved)
        if ranked
        else (_without_value(summary, measure),),
        caveats=tuple(caveats),
    )


def _ranked(
    settings: Sequence[Setting], values: Mapping[str, pd.Series[float]], better: Better
) -> tuple[list[Setting], tuple[Comparison, ...]]:
    """Settings that have values, the best first, and the best against each of the others."""
    used = [s for s in settings if s.n]
    if not used:
        return [], ()
    spread = Spread.of(values)
    used.sort(key=lambda s: spread.mean(s.label), reverse=better == "larger")
    return used, compare(used[0], used[1:], spread)


def rank_runs(summary: pd.DataFrame, measure: str, better: Better = "larger") -> dict[str, str]:
    """Best, median and worst usable run by the objective.

    Parameters
    ----------
    summary : DataFrame
    measure : str
    better : {"larger", "smaller", "neither"}

    Returns
    -------
    dict
        ``best``, ``median`` and ``worst`` to the run's name, ``highest``, ``median`` and
        ``lowest`` where neither is better; fewer where fewer runs are usable. Of an even number of
        runs the better of the two middle ones is the median.
    """
    first, last = ("highest", "lowest") if better == "neither" else ("best", "worst")
    values = bounded_values(summary, measure).dropna()
    values = values.sort_values(ascending=better == "smaller", kind="stable")
    runs = [str(r) for r in summary.loc[values.index, RUN]]
    ranks: dict[str, str] = {}
    for role, place in ((first, 0), (last, -1), ("median", (len(runs) - 1) // 2)):
        if runs and runs[place] not in ranks.values():
            ranks[role] = runs[place]
    return {role: ranks[role] for role in (first, "median", last) if role in ranks}


def sand_notes(
    keys: Sequence[str],
    stage: VibrationStage | None,
    seeks_best: bool = True,
    is_controlled: bool = False,
) -> tuple[str, ...]:
    """What a sweep over sand leaves open: what the vibration held constant, and the springs.

    Parameters
    ----------
    keys : sequence of str
        Swept keys.
    stage : VibrationStage, optional
    seeks_best : bool
        Whether the study looks for the best setting.
    is_controlled : bool
        Whether its controls have been run.
    """
    notes = []
    if stage is not None and any(k.endswith("frequency_hz") for k in keys):
        others = [w for w in ("acceleration", "velocity", "displacement") if w != stage.hold]
        held = "moment of the" if stage.hold == "unbalance" else "amplitude of"
        notes.append(
            f"The {held} {stage.hold} was held constant while the frequency changed. With "
            f"{' or '.join(others)} held instead, another frequency may be best."
        )
    return (*notes, NOT_TESTED) if seeks_best and not is_controlled else tuple(notes)


def _is_identical(
    comparison: Comparison, values: Mapping[str, pd.Series[float]], best: Setting | None
) -> bool:
    """Whether replicates are there but do not differ."""
    enough = best is not None and min(best.n, len(values[comparison.other])) > 1
    return enough and not comparison.tested


def _identical(others: list[str]) -> list[str]:
    if not others:
        return []
    return [
        f"The replicates of the best setting and of {listed(others)} differ by no more than "
        "round-off, so they say nothing about chance. Check that the seed reaches the sand."
    ]


def _run_caveats(
    settings: Sequence[Setting], summary: pd.DataFrame, keys: Sequence[str], measure: str,
    seeks_best: bool, draws_by_lot: bool,
) -> list[str]:  # fmt: skip
    caveats = []
    planned, used = len(summary), sum(s.n for s in settings)
    if used < planned:
        caveats.append(
            f"Not used: {planned - used} of {planned} runs ({reasons_sentence(summary, measure)})."
        )
    empty = [s.label for s in settings if s.n == 0]
    if empty and used:
        so = ": the best may lie there" if seeks_best else ""
        caveats.append(f"No run can be used at {listed(empty)}{so}.")
    few = [s.label for s in settings if 0 < s.n < FEW]
    if few and draws_by_lot:
        caveats.append(f"Fewer than {FEW} usable replicates at {listed(few)}.")
    loops = _loop_caveats(settings, summary, keys, measure)
    return [*caveats, *loops, *filter(None, [one_way_caveat(summary)])]


def _edge_caveats(
    best: Setting | None, settings: Sequence[Setting], keys: Sequence[str], resolved: bool
) -> list[str]:
    """Say where the best lies at the end of a swept range: the true best may lie beyond."""
    caveats = []
    for key in keys if best else ():
        values = [s.values[key] for s in settings]
        if not all(isinstance(v, int | float) and math.isfinite(v) for v in values):
            continue
        mine = best.values[key] if best else None
        if min(values) < max(values) and mine in (min(values), max(values)):
            end = "lowest" if mine == min(values) else "highest"
            name = name_of(key)
            what = f"best {name}" if resolved else f"{name} with the best mean"
            caveats.append(
                f"The {what}, {value_text(key, mine)}, is the {end} one swept: the "
                "true best may lie beyond it."
            )
    return caveats


def _sentences(
    measure: str,
    better: Better,
    settings: Sequence[Setting],
    ranked: Sequence[Setting],
    comparisons: Sequence[Comparison],
    resolved: bool,
) -> tuple[str, ...]:
    what = name_of(measure)
    best = ranked[0]
    mean = with_margin(best.mean, best.ci_half_width)
    if len(ranked) == 1:
        only = "One setting was run" if len(settings) == 1 else "Only one setting has usable runs"
        return (
            f"Not resolved: nothing to compare with. {only}, {best.label}, with a {what} of "
            f"{mean}.",
        )
    second, first = ranked[1], comparisons[0]
    most = "highest" if better == "larger" else "lowest"
    if resolved:
        return (
            f"{_capital(best.label)} is best: it gives the {most} {what}, {mean}, against "
            f"{with_margin(second.mean, second.ci_half_width)} at {second.label}, the runner-up.",
            _difference_sentence(first, ranked),
        )
    highest = max(ranked, key=lambda s: s.mean if better == "larger" else -s.mean)
    where = (
        f"The {most} mean, {mean}, is that of {best.label}."
        if best.mean == highest.mean
        else f"The {most} among like replicates is {best.label}, with a mean of {mean}."
    )
    like = [c.other for c in comparisons if not c.separated]
    worse = [c.other for c in comparisons if c.separated]
    ruled_out = f" Ruled out: {listed(worse)}." if worse else ""
    again = (
        _difference_sentence(first, ranked)
        if first.tested
        else f"{_capital(best.label)} and {second.label} need two replicates or more, with "
        "different values, before their difference can be told from chance."
    )
    return (
        f"Not resolved: no setting can be recommended for its {what}. {where} At 95 % "
        f"confidence it cannot be told apart from {listed(like)}.{ruled_out}"
        f"{_more_sentence(comparisons, best)}",
        again,
    )


def further_replicates(comparisons: Sequence[Comparison], best: Setting) -> int | None:
    """How many more replicates would tell the best from those that it cannot be told from.

    An interval shrinks with the root of the number of replicates, so that it leaves zero out once
    n (half width / difference)^2 of them are there.

    Returns
    -------
    int or None
        Of each of these settings, if their differences are as large as they seem. None where
        nothing is open, or where too few replicates tell.
    """
    open_ones = [c for c in comparisons if c.tested and not c.separated]
    beyond = [abs(c.difference) - c.loop_error for c in open_ones]
    if not open_ones or min(beyond) <= 0.0:
        return None
    half = [(c.ci[1] - c.ci[0]) / 2 - c.loop_error for c in open_ones]
    needed = max(best.n * (h / left) ** 2 for h, left in zip(half, beyond, strict=True))
    return math.ceil(needed) - best.n


def _more_sentence(comparisons: Sequence[Comparison], best: Setting) -> str:
    more = further_replicates(comparisons, best)
    if more is None:
        return ""
    if more > MOST_NAMED:
        return " These few runs cannot show a difference." if best.n < MANY else ""
    return (
        f" If the differences are as large as they seem, about {more} more replicates of each "
        "of these settings decide."
    )


def _mean_error(errors: pd.Series[float]) -> float:
    """Mean of what the loops of a setting's runs leave open."""
    known = errors.dropna()
    return float(known.mean()) if len(known) else 0.0


def _loop_caveats(
    settings: Sequence[Setting], summary: pd.DataFrame, keys: Sequence[str], measure: str
) -> list[str]:
    """Say what loops that do not hold leave open, and what the runs gave that do not count."""
    caveats = []
    open_ones = [s for s in settings if s.loop_error > 0.0]
    if open_ones:
        most = display_number(measure, max(s.loop_error for s in open_ones), 2)
        where = listed([s.label for s in open_ones]) if keys else "this setting"
        caveats.append(
            f"Not every loop between sand and pattern holds at {where}. How far the values may be "
            f"off, up to {most} in the mean, is added to every interval."
        )
    failed = shown_values(summary, measure).where(loop_barred(summary, measure))
    errors = loop_errors(summary, measure)
    gave = []
    for at, rows in setting_rows(summary, keys):
        values = failed.iloc[rows].dropna()
        if len(values):
            off = error_text(measure, float(errors.loc[values.index].max()))
            where = f"{setting_text(at)}: " if keys else ""
            mean = display_number(measure, float(values.mean()))
            gave.append(f"{where}{mean} (runs: {len(values)}; {off})")
    if gave:
        caveats.append(
            "What runs gave whose loops do not hold, not counted and not to be trusted: "
            f"{', '.join(gave)}."
        )
    return caveats


def _without_value(summary: pd.DataFrame, measure: str) -> str:
    """Why no setting has a mean."""
    complete = int(finished(summary).sum())
    if not complete:
        return "Not resolved: no run finished."
    return (
        f"Not resolved: {complete} of {len(summary)} runs finished, but none gives a "
        f"{name_of(measure)} that can be used ({reasons_sentence(summary, measure)})."
    )


def _capital(text: str) -> str:
    return text[:1].upper() + text[1:]


def _difference_sentence(first: Comparison, settings: Sequence[Setting]) -> str:
    fewest, most = min(s.n for s in settings), max(s.n for s in settings)
    how = f"{fewest} replicates" if fewest == most else f"{fewest} to {most} replicates"
    together = f", {len(settings)} settings compared together" if len(settings) > 2 else ""
    apart = settings[0].mean - settings[1].mean
    is_of_means = math.isclose(first.difference, apart, rel_tol=1e-6, abs_tol=1e-12)
    of_what = (
        "" if is_of_means else " Like replicates are compared, so it is not that of the means."
    )
    return (
        f"The difference from {first.other} is {number(first.difference, 2)}, with a 95 % interval "
        f"from {number(first.ci[0], 2)} to {number(first.ci[1], 2)} ({how}{together}).{of_what}"
    )
