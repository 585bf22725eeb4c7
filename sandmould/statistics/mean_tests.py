"""Tests of a difference of two means."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from functools import cache

import numpy as np
import pandas as pd
import scipy
from numpy.typing import NDArray

CONFIDENCE = 0.95
_MANY = 10.0
"""Times as many replicates from which the search for how many would decide begins."""
_ROUNDS = 4


@dataclass(frozen=True)
class MeanTest:
    """Test of a difference of two means, as ``scipy.stats`` has it.

    That package takes half a second to load, so Student's t does without it.
    """

    difference: float
    error: float
    """Standard error of it."""
    df: float
    """Degrees of freedom."""
    means: int = 2
    """How many means there are: the test holds for all their pairs together, by Tukey's
    studentized range; of two this is Student's t."""

    @property
    def pvalue(self) -> float:
        """Of both sides."""
        beyond = abs(self.difference) / self.error
        if self.means > 2:
            return _range_beyond(math.sqrt(2.0) * beyond, self.means, self.df)
        return 2.0 * float(scipy.special.stdtr(self.df, -beyond))

    def confidence_interval(self, level: float) -> tuple[float, float]:
        """Interval of the difference."""
        half = self._reach(level, self.df) * self.error
        return self.difference - half, self.difference + half

    def factor_to_tell(self) -> float:
        """Times as many replicates with which the interval would leave zero out.

        The error goes as the root of their number, and degrees of freedom grow with it.
        """
        times = _MANY
        for _ in range(_ROUNDS):
            reach = self._reach(CONFIDENCE, round(times * self.df))
            times = max(1.0, (reach * self.error / self.difference) ** 2)
        return times

    def _reach(self, level: float, df: float) -> float:
        """Half width of the interval over the error."""
        if self.means > 2:
            return _range_reached(level, self.means, df) / math.sqrt(2.0)
        return float(scipy.special.stdtrit(df, 0.5 + level / 2))


@cache
def _range_reached(level: float, means: int, df: float) -> float:
    """Quantile of the studentized range: an integral that takes a tenth of a second."""
    from scipy.stats import studentized_range

    return float(studentized_range.ppf(level, means, df))


def _range_beyond(reach: float, means: int, df: float) -> float:
    from scipy.stats import studentized_range

    return float(studentized_range.sf(reach, means, df))


def compare_means(
    first: pd.Series[float], second: pd.Series[float]
) -> tuple[MeanTest, bool] | None:
    """Test the difference of two means: in pairs where both have the same blocks, else by Welch.

    Gives the test, and whether it is paired. None where a side has fewer than two values, or where
    no spread is left to test by.
    """
    if len(first) < 2 or len(second) < 2:
        return None
    index = first.index
    paired = index.is_unique and second.index.is_unique and set(index) == set(second.index)
    x = np.asarray(first, dtype=np.float64)
    y = np.asarray(second.reindex(index) if paired else second, dtype=np.float64)
    samples = [x - y] if paired else [x, y]
    test = welch(float(x.mean() - y.mean()), *((float(s.std(ddof=1)), len(s)) for s in samples))
    if test is None or test.error <= 1e-12 * max(float(np.abs(x).max()), float(np.abs(y).max())):
        return None
    return test, paired


def welch(difference: float, *samples: tuple[float, int]) -> MeanTest | None:
    """Test a difference by standard deviation and number of each sample; None without spread.

    One sample is that of the differences of pairs.
    """
    variances = [sd**2 / n for sd, n in samples]
    if not (total := sum(variances)) > 0.0:
        return None
    # Satterthwaite's degrees of freedom; of pairs, one less than there are
    parts = [v**2 / (n - 1) for v, (_, n) in zip(variances, samples, strict=True)]
    return MeanTest(difference, math.sqrt(total), total**2 / sum(parts))


def alike_pvalue(samples: Sequence[NDArray[np.float64]]) -> float:
    """Chance of spreads as unlike as those of some samples, if they have one (Bartlett 1937).

    Samples of one value, or of equal ones, tell none.
    """
    told = [sample for sample in samples if np.ptp(sample) > 0.0]
    variance = np.array([sample.var(ddof=1) for sample in told])
    if len(told) < 2:
        return 1.0
    df = np.array([len(sample) - 1 for sample in told])
    pooled = float(df @ variance) / df.sum()
    apart = df.sum() * math.log(pooled) - float(df @ np.log(variance))
    bias = 1.0 + (float((1.0 / df).sum()) - 1.0 / df.sum()) / (3.0 * (len(told) - 1))
    return float(scipy.special.chdtrc(len(told) - 1, apart / bias))
