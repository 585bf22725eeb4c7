"""The settings of a study compared by their means: which is best, and how sure that is."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import pandas as pd

from sandmould.runs.columns import RUN
from sandmould.statistics.config import Better
from sandmould.statistics.contrasts import Spread
from sandmould.statistics.evidence import usable_values
from sandmould.statistics.settings import (
    Comparison,
    Setting,
    is_wide,
    number_blocks,
    runs_differ,
    setting_of,
    setting_rows,
)

FEW = 3
"""Replicates from which on a setting's own interval tells something."""
_ROUND_OFF = 1e-12


@dataclass(frozen=True)
class Verdict:
    """The comparison of the settings of a study."""

    measure: str
    better: Better
    settings: tuple[Setting, ...]
    best: Setting | None
    runner_up: Setting | None
    difference: float
    """Mean of the best minus that of the runner-up, or over it, see ``by_factor``; NaN without two
    settings."""
    ci: tuple[float, float]
    p: float
    resolved: bool
    comparisons: tuple[Comparison, ...]
    """The best against every other setting, nearest first."""
    is_wide: bool
    """Whether the means are all above zero and apart by a factor of ``WIDE_MEASURE`` or more."""
    spread: Spread | None
    """Of the runs, or of their logarithms where these are compared; None without a value."""

    @property
    def by_factor(self) -> bool:
        """Whether settings are compared by the logarithm: by how many times as much one has."""
        return any(c.is_factor for c in self.comparisons)

    def against(self, setting: Setting) -> Comparison | None:
        """Comparison of the best with a setting."""
        return next((c for c in self.comparisons if c.other == setting.label), None)

    def setting(self, label: str) -> Setting:
        """The setting of a label."""
        return next(s for s in self.settings if s.label == label)


def compare_settings(
    summary: pd.DataFrame, keys: Sequence[str], measure: str, better: Better = "larger"
) -> Verdict:
    """Compare the settings of a study by the mean of the objective.

    Only runs that are evidence of the objective count, see ``evidence``. Settings are compared
    by the spread that all share, that of an analysis of variance, or by their own, see
    ``Spread.compare``. Replicates share their seeds across settings: what a replicate shifts in all
    of them drops out of their differences, see ``Spread.of``. Where settings have unlike
    replicates, these differences also rank them. The best is picked after seeing the data:
    intervals and p values hold for all pairs of settings together (Tukey 1953; Kramer 1956 for
    unlike numbers of replicates). Where means differ more than a hundredfold, see ``is_wide``, all
    this is done with the logarithms: the scatter of the large ones would hide the small ones.

    ``summary``: one row a run, see ``collect``.
    """
    in_blocks = usable_values(summary, measure).set_axis(number_blocks(summary))
    groups = [(at, len(rows), in_blocks.iloc[rows].dropna()) for at, rows in
              setting_rows(summary, keys)]  # fmt: skip
    settings = tuple(setting_of(*group) for group in groups)
    of_setting = {s.label: group[2] for s, group in zip(settings, groups, strict=True)}
    wide = is_wide(measure, settings, in_blocks)
    several = [s for s in settings if s.n > 1]
    scatters = any(s.sd > _ROUND_OFF * abs(s.mean) for s in several)
    exact = bool(several) and not scatters and runs_differ(summary, keys)
    ranked, comparisons, spread = _ranked(settings, of_setting, better, wide, exact)
    first = comparisons[0] if comparisons else None
    resolved = first is not None and first.separated
    return Verdict(
        measure=measure,
        better=better,
        settings=settings,
        best=ranked[0] if ranked else None,
        runner_up=ranked[1] if len(ranked) > 1 else None,
        difference=first.difference if first else math.nan,
        ci=first.ci if first else (math.nan, math.nan),
        p=first.p if first else math.nan,
        resolved=resolved and all(c.separated for c in comparisons if c.tested),
        comparisons=comparisons,
        is_wide=wide,
        spread=spread,
    )


def _ranked(
    settings: Sequence[Setting],
    values: Mapping[str, pd.Series[float]],
    better: Better,
    by_logarithm: bool,
    is_exact: bool,
) -> tuple[list[Setting], tuple[Comparison, ...], Spread | None]:
    """Settings that have values, the best first, and the best against each of the others.

    Logarithms that are not tested tell nothing more than the values.
    """
    used = [s for s in settings if s.n]
    if not used:
        return [], (), None
    taken = {k: v.map(math.log) for k, v in values.items()} if by_logarithm else values
    spread = Spread.of(taken, is_exact)
    used.sort(key=lambda s: spread.mean(s.label), reverse=better == "larger")
    comparisons = tuple(
        Comparison.of(s.label, *spread.compare(used[0].label, s.label), by_logarithm)
        for s in used[1:]
    )
    if by_logarithm and not any(c.tested for c in comparisons):
        return _ranked(settings, values, better, False, is_exact)
    return used, comparisons, spread


def rank_runs(summary: pd.DataFrame, measure: str, better: Better = "larger") -> dict[str, str]:
    """Best, median and worst usable run by the objective.

    Gives ``best``, ``median`` and ``worst`` to the run's name, ``highest``, ``median`` and
    ``lowest`` where neither is better; fewer where fewer runs are usable. Of an even number of runs
    the better of the two middle ones is the median.
    """
    first, last = ("highest", "lowest") if better == "neither" else ("best", "worst")
    values = usable_values(summary, measure).dropna()
    values = values.sort_values(ascending=better == "smaller", kind="stable")
    runs = [str(r) for r in summary.loc[values.index, RUN]]
    ranks: dict[str, str] = {}
    for role, place in ((first, 0), (last, -1), ("median", (len(runs) - 1) // 2)):
        if runs and runs[place] not in ranks.values():
            ranks[role] = runs[place]
    return {role: ranks[role] for role in (first, "median", last) if role in ranks}


def further_replicates(comparisons: Sequence[Comparison], best: Setting) -> int | None:
    """How many more replicates would tell the best from those that it cannot be told from.

    So many of each of these settings, if their differences are as large as they seem. None where
    nothing is open, or where too few replicates tell.
    """
    open_ones = [c for c in comparisons if c.tested and not c.separated]
    tests = [c.test for c in open_ones if c.test is not None]
    if not tests or min(abs(test.difference) for test in tests) <= 0.0:
        return None
    needed = max(test.factor_to_tell() for test in tests)
    return math.ceil(needed * best.n) - best.n
