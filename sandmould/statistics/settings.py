"""Means of the settings of a study, and the best against each of the others."""

from __future__ import annotations

import math
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from functools import cache
from typing import Any

import numpy as np
import pandas as pd
from numpy.typing import NDArray
from scipy.special import stdtr, stdtrit

from sandmould.runs.columns import REPLICATE, SEED
from sandmould.runs.formatting import setting_text

CONFIDENCE = 0.95


@dataclass(frozen=True)
class Setting:
    """One combination of swept values and the objective of its usable runs."""

    values: Mapping[str, Any]
    label: str
    planned: int
    n: int
    """Runs with a value that can be used."""
    mean: float
    sd: float
    """Standard deviation over replicates; NaN for fewer than two."""
    ci_half_width: float
    """Half width of the 95 % interval of this mean alone, with the error of the loops; NaN for
    fewer than two."""
    loop_error: float = 0.0
    """Mean over the runs of what their loops leave open of the value."""


@dataclass(frozen=True)
class Comparison:
    """The best setting minus another one, judged for all pairs of settings together."""

    other: str
    difference: float
    test: MeanTest | None
    """None where replicates are too few or identical."""
    loop_error: float = 0.0
    """What loops leave open of the difference; a part of the interval that no more runs narrow."""

    @property
    def ci(self) -> tuple[float, float]:
        """95 % interval; NaN without a test."""
        return self.test.confidence_interval(CONFIDENCE) if self.test else (math.nan, math.nan)

    @property
    def p(self) -> float:
        """Two-sided; NaN without a test. It takes a hundredth of a second."""
        return self.test.pvalue if self.test else math.nan

    @property
    def separated(self) -> bool:
        """Whether the interval lies on the side of the difference, zero left out."""
        return self.ci[0] > 0 or self.ci[1] < 0

    @property
    def tested(self) -> bool:
        """Whether there were enough replicates, with different values, to test."""
        return self.test is not None


def setting_rows(
    summary: pd.DataFrame, keys: Sequence[str]
) -> list[tuple[dict[str, Any], NDArray[np.intp]]]:
    """Each combination of swept values with the places of its rows, in rising order of numbers."""
    if not keys:
        return [({}, np.arange(len(summary)))] if len(summary) else []
    number = summary.groupby(list(keys), sort=False, dropna=False).ngroup().to_numpy()
    order = np.argsort(number, kind="stable")
    rows = np.split(order, np.flatnonzero(np.diff(number[order])) + 1)
    values = summary[list(keys)].iloc[[own[0] for own in rows]].to_dict("records")
    groups = [({str(k): v for k, v in at.items()}, r) for at, r in zip(values, rows, strict=True)]
    if all(pd.api.types.is_numeric_dtype(summary[k]) for k in keys):
        groups.sort(key=lambda group: tuple(group[0].values()))
    return groups


def group_settings(
    summary: pd.DataFrame, keys: Sequence[str]
) -> list[tuple[dict[str, Any], pd.DataFrame]]:
    """Each combination of swept values with its rows; see ``setting_rows``."""
    return [(values, summary.iloc[rows]) for values, rows in setting_rows(summary, keys)]


def setting_of(
    values: dict[str, Any], planned: int, measured: pd.Series[float], loop_error: float = 0.0
) -> Setting:
    """Mean, spread and interval of one setting's finished values."""
    n = len(measured)
    sd = float(measured.std(ddof=1)) if n > 1 else math.nan
    half = float(stdtrit(n - 1, 0.5 + CONFIDENCE / 2)) * sd / math.sqrt(n) if n > 1 else sd
    mean = float(measured.mean()) if n else math.nan
    return Setting(
        values, setting_text(values), planned, n, mean, sd, half + loop_error, loop_error
    )


def number_blocks(summary: pd.DataFrame) -> NDArray[np.intp]:
    """Number of each run's block, (n,): one for a replicate with its seed, else one a row."""
    blocks = [c for c in (REPLICATE, SEED) if c in summary]
    if REPLICATE not in blocks:
        return np.arange(len(summary))
    return np.asarray(summary.groupby(blocks, sort=False, dropna=False).ngroup(), dtype=np.intp)


def by_block(
    summary: pd.DataFrame, values: pd.Series[float], over: Sequence[str] = ()
) -> pd.Series[float]:
    """Values by replicate, seed and further keys, or by row where replicates are not told apart."""
    blocks = [c for c in (REPLICATE, SEED, *over) if c in summary]
    if REPLICATE not in blocks:
        return values.rename(index=lambda row: ("row", row))
    rows = summary.loc[values.index, blocks]
    return pd.Series(values.to_numpy(), index=[tuple(r) for r in rows.to_numpy().tolist()])


@dataclass(frozen=True)
class Spread:
    """Standard deviation of a run that all settings share, by an analysis of variance."""

    sd: float
    """Round the mean of its setting; where all settings have the same blocks, apart from what a
    block shifts in all of them. NaN without a degree of freedom."""
    df: int
    settings: int

    @staticmethod
    def of(values: Iterable[pd.Series[float]]) -> Spread:
        """Pool the spread of the settings' values by block.

        Replicates that share their seeds are one block. A shift that a block gives to all settings
        drops out of their differences, so it does not count.
        """
        used = [v for v in values if len(v)]
        blocks = used[0].index if used else pd.Index([])
        in_blocks = all(v.index.is_unique and set(v.index) == set(blocks) for v in used)
        if in_blocks:
            table = np.array([v.reindex(blocks) for v in used], dtype=np.float64)
            table = table.reshape(len(used), len(blocks))
            left = table - table.mean(axis=1, keepdims=True) - table.mean(axis=0) + table.mean()
            df = (len(used) - 1) * (len(blocks) - 1)
        else:
            left = np.concatenate([v - v.mean() for v in used])
            df = len(left) - len(used)
        sd = math.sqrt(float((left**2).sum()) / df) if df > 0 else math.nan
        return Spread(sd, df, len(used))

    def test(
        self, first: pd.Series[float], second: pd.Series[float], loop_error: float = 0.0
    ) -> MeanTest | None:
        """Test the difference of two means, for all pairs of settings together (Tukey, Kramer).

        Where the two scatter more than all settings do, their own spread counts: the shared one
        would then call chance a difference. None where no spread is left to test by.
        """
        error = self.sd * math.sqrt(1.0 / len(first) + 1.0 / len(second))
        if (own := compare_means(first, second)) is not None and self.df > 0:
            error = max(error, own[0].error)
        if not error > 1e-12 * max(float(np.abs(first).max()), float(np.abs(second).max())):
            return None
        difference = float(first.mean() - second.mean())
        return MeanTest(difference, error, self.df, loop_error, self.settings)


def compare(
    best: Setting,
    others: Sequence[Setting],
    values: Mapping[str, pd.Series[float]],
    spread: Spread,
) -> tuple[Comparison, ...]:
    """The best minus each other setting, nearest first.

    Parameters
    ----------
    best : Setting
    others : sequence of Setting
    values : mapping of label to Series of float
        Of each setting, by block.
    spread : Spread
        By which all are compared.
    """
    comparisons = []
    for other in others:
        loop_error = best.loop_error + other.loop_error
        test = spread.test(values[best.label], values[other.label], loop_error)
        comparisons.append(Comparison(other.label, best.mean - other.mean, test, loop_error))
    return tuple(comparisons)


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
    loop_error: float = 0.0
    """By which the difference may be off besides."""
    means: int = 2
    """How many means there are: the test holds for all their pairs together, by Tukey's
    studentized range; of two this is Student's t."""

    @property
    def pvalue(self) -> float:
        """Of both sides."""
        beyond = max(0.0, abs(self.difference) - self.loop_error) / self.error
        if self.means > 2:
            return _range_beyond(math.sqrt(2.0) * beyond, self.means, self.df)
        return 2.0 * float(stdtr(self.df, -beyond))

    def confidence_interval(self, level: float) -> tuple[float, float]:
        """Interval of the difference."""
        if self.means > 2:
            reach = _range_reached(level, self.means, self.df) / math.sqrt(2.0)
        else:
            reach = float(stdtrit(self.df, 0.5 + level / 2))
        half = reach * self.error + self.loop_error
        return self.difference - half, self.difference + half


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

    Returns
    -------
    (MeanTest, bool) or None
        The test, and whether it is paired. None where a side has fewer than two values, or where
        no spread is left to test by.
    """
    if len(first) < 2 or len(second) < 2:
        return None
    index = first.index
    paired = index.is_unique and second.index.is_unique and set(index) == set(second.index)
    x = np.asarray(first, dtype=np.float64)
    y = np.asarray(second.reindex(index) if paired else second, dtype=np.float64)
    samples = [x - y] if paired else [x, y]
    variances = [float(v.var(ddof=1)) / len(v) for v in samples]
    error = math.sqrt(sum(variances))
    if error <= 1e-12 * max(float(np.abs(x).max()), float(np.abs(y).max())):
        return None
    # Satterthwaite's degrees of freedom; of pairs, one less than there are.
    parts = [v**2 / (len(s) - 1) for v, s in zip(variances, samples, strict=True)]
    return MeanTest(float(x.mean() - y.mean()), error, sum(variances) ** 2 / sum(parts)), paired
