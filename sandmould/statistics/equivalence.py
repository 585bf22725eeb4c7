"""Whether two settings agree: two one-sided t tests against a margin set before the runs."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Literal

import numpy as np
import pandas as pd
import scipy

from sandmould.runs.templates import worded
from sandmould.statistics.mean_tests import compare_means

EquivalenceVerdict = Literal["equivalent", "different", "not resolved", "not tested"]
CONFIDENCE = 0.9
"""Of the interval that must lie inside the margin: two one-sided tests at 5 %."""
PERCENT = "90 %"
POWER = 0.8
"""Chance of a verdict that the estimate of further replicates is made for."""
MOST_REPLICATES = 1000
"""More than this are not asked for: the difference then lies on the margin."""


@dataclass(frozen=True)
class Agreement:
    """How far the means of two settings agree in one measure."""

    means: tuple[float, float]
    """Of the runs that are compared."""
    ci: tuple[float, float]
    """Interval of the difference, NaN where it cannot be tested."""
    margin: float
    n: int
    """Pairs, or runs of the smaller group."""
    paired: bool
    verdict: EquivalenceVerdict
    more: int | None = None
    """Further replicates that would probably resolve it, where that is not too many."""

    @property
    def difference(self) -> float:
        """Mean of the first minus that of the second."""
        return self.means[0] - self.means[1]

    @property
    def is_one_number(self) -> bool:
        """Whether all pairs are the same to round-off."""
        return self.ci[0] == self.ci[1] and abs(self.difference) < 1e-9 * self.margin

    @property
    def note(self) -> str:
        """What the verdict rests on, where that needs words."""
        return worded("agreement_note.j2", it=self, most=MOST_REPLICATES)


def agree(first: pd.Series[float], second: pd.Series[float], margin: float) -> Agreement:
    """Test whether two means differ by less than a margin.

    The interval of the difference inside the margin is the same as two one-sided t tests, each at
    half of what is missing to full confidence: then they are equivalent. Wholly outside, they
    differ by more than the margin. Anything else is not resolved, however small the difference
    seems: a wide spread is no agreement.

    ``first``, ``second``: values by block: replicates that share their seeds have one label. Blocks
    that both have are compared in pairs; without a common one the groups are compared by Welch's
    test.
    """
    shared = first.index.intersection(second.index)
    if len(shared):
        first, second = first.loc[shared], second.loc[shared]
    n = min(len(first), len(second))
    means = float(first.mean()), float(second.mean())
    difference = means[0] - means[1]
    nothing = (math.nan, math.nan)
    if n < 2:
        return Agreement(means, nothing, margin, n, bool(len(shared)), "not tested")
    test = compare_means(first, second)
    if test is None:
        return _without_spread(first, means, margin, n)
    result, paired = test
    low, high = result.confidence_interval(CONFIDENCE)
    ci = float(low), float(high)
    verdict = classify_interval(ci, margin)
    if verdict != "not resolved":
        return Agreement(means, ci, margin, n, paired, verdict)
    error = (ci[1] - ci[0]) / 2 / float(scipy.special.stdtrit(result.df, 0.5 + CONFIDENCE / 2))
    more = _more(abs(difference), error * math.sqrt(n), margin, n, paired)
    return Agreement(means, ci, margin, n, paired, verdict, more)


def classify_interval(ci: tuple[float, float], margin: float) -> EquivalenceVerdict:
    """Verdict on an interval: inside the margin, wholly outside, or neither."""
    low, high = ci
    if -margin < low and high < margin:
        return "equivalent"
    return "different" if low > margin or high < -margin else "not resolved"


def _without_spread(
    first: pd.Series[float], means: tuple[float, float], margin: float, n: int
) -> Agreement:
    """Pairs that all differ by the same amount, most often by nothing."""
    if float(first.std(ddof=1)) <= 1e-12 * float(first.abs().max()):
        return Agreement(means, (math.nan, math.nan), margin, n, True, "not tested")
    difference = means[0] - means[1]
    ci = (difference, difference)
    return Agreement(means, ci, margin, n, True, classify_interval(ci, margin))


def _more(size: float, spread: float, margin: float, n: int, paired: bool) -> int | None:
    """Further replicates after which a verdict is likely, if size and spread stay as they are.

    ``spread`` is the standard error of the difference times the root of n.
    """
    replicates = np.arange(n + 1, MOST_REPLICATES + 1)
    freedom = (replicates - 1) * (1 if paired else 2)
    error = spread / np.sqrt(replicates)
    need = scipy.special.stdtrit(freedom, 0.5 + CONFIDENCE / 2)
    chance = scipy.special.stdtr(freedom, (size - margin) / error - need)
    if size < margin:
        inside = scipy.special.stdtr(freedom, (margin - size) / error - need)
        chance = inside + scipy.special.stdtr(freedom, (margin + size) / error - need) - 1
    enough = np.flatnonzero(chance >= POWER)
    return int(replicates[enough[0]]) - n if len(enough) else None
