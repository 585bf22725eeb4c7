"""Means of the settings of a study, and the best against each of the others."""

from __future__ import annotations

import math
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
import pandas as pd
import scipy
from numpy.typing import NDArray

from sandmould.runs.columns import OF_RUN, REPLICATE, SEED
from sandmould.runs.formatting import setting_text
from sandmould.statistics.mean_tests import CONFIDENCE, MeanTest

WIDE_MEASURE, WIDE_KEY = 100.0, 30.0
"""Largest value over the smallest from which a measure and a swept key are told and drawn by their
logarithm (argued)."""
_MOST_LOGARITHM = 700.0
"""Its exponential is a number yet."""


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
    """Half width of the 95 % interval of this mean alone; NaN for fewer than two."""


@dataclass(frozen=True)
class Comparison:
    """The best setting minus another one, judged for all pairs of settings together."""

    other: str
    difference: float
    test: MeanTest | None
    """None where replicates are too few or identical."""
    is_factor: bool
    """Whether logarithms were tested: the difference is then the best over the other one."""

    @staticmethod
    def of(
        other: str, difference: float, test: MeanTest | None, are_logarithms: bool
    ) -> Comparison:
        """By a difference of values or of logarithms."""
        apart = _factor(difference) if are_logarithms else difference
        return Comparison(other, apart, test, are_logarithms)

    @property
    def ci(self) -> tuple[float, float]:
        """95 % interval; NaN without a test."""
        low, high = self._tested
        return (_factor(low), _factor(high)) if self.is_factor else (low, high)

    @property
    def _tested(self) -> tuple[float, float]:
        return self.test.confidence_interval(CONFIDENCE) if self.test else (math.nan, math.nan)

    @property
    def p(self) -> float:
        """Two-sided; NaN without a test. It takes a hundredth of a second."""
        return self.test.pvalue if self.test else math.nan

    @property
    def separated(self) -> bool:
        """Whether the interval lies on the side of the difference, zero left out."""
        low, high = self._tested
        return low > 0 or high < 0

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


def runs_differ(summary: pd.DataFrame, keys: Sequence[str]) -> bool:
    """Whether anything that was measured differs between runs of one setting."""
    measured = measures_of(summary, keys)
    each = (measured.iloc[rows].nunique() for _, rows in setting_rows(summary, keys))
    return any((values > 1).any() for values in each)


def measures_of(summary: pd.DataFrame, keys: Sequence[str]) -> pd.DataFrame:
    """Columns of numbers that were measured, and neither swept nor a run's cost."""
    numbers = summary.select_dtypes("number")
    return numbers[[column for column in numbers if column not in {*OF_RUN, *keys}]]


def group_settings(
    summary: pd.DataFrame, keys: Sequence[str]
) -> list[tuple[dict[str, Any], pd.DataFrame]]:
    """Each combination of swept values with its rows; see ``setting_rows``."""
    return [(values, summary.iloc[rows]) for values, rows in setting_rows(summary, keys)]


def setting_of(values: dict[str, Any], planned: int, measured: pd.Series[float]) -> Setting:
    """Mean, spread and interval of one setting's finished values."""
    n = len(measured)
    sd = float(measured.std(ddof=1)) if n > 1 else math.nan
    half = (
        float(scipy.special.stdtrit(n - 1, 0.5 + CONFIDENCE / 2)) * sd / math.sqrt(n)
        if n > 1
        else sd
    )
    mean = float(measured.mean()) if n else math.nan
    return Setting(values, setting_text(values), planned, n, mean, sd, half)


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


def _factor(logarithm: float) -> float:
    return math.exp(min(logarithm, _MOST_LOGARITHM))


def spans(values: Iterable[float], least: float) -> bool:
    """Whether values are all above zero, and the largest is so many times the smallest."""
    known = [value for value in values if math.isfinite(value)]
    return bool(known) and min(known) > 0.0 and max(known) >= least * min(known)


def is_wide(measure: str, settings: Sequence[Setting], values: Iterable[float]) -> bool:
    """Whether settings differ so much in a measure that its logarithm tells them apart.

    A share has a scale of its own, from 0 to 1.

    ``values``: of all runs.
    """
    is_share = measure.endswith("_fraction")
    means = (s.mean for s in settings if s.n)
    return not is_share and spans(values, 1.0) and spans(means, WIDE_MEASURE)
