"""Means of the settings of a study, and the best against each of the others."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
import pandas as pd
from scipy import stats

from sandmould.runs.columns import REPLICATE, SEED
from sandmould.runs.formatting import setting_text

CONFIDENCE = 0.95


@dataclass(frozen=True)
class Setting:
    """One combination of swept values and the objective of its finished runs."""

    values: Mapping[str, Any]
    label: str
    planned: int
    n: int
    """Finished runs with a value."""
    mean: float
    sd: float
    """Standard deviation over replicates; NaN for fewer than two."""
    ci_half_width: float
    """Half width of the 95 % interval of this mean alone; NaN for fewer than two."""


@dataclass(frozen=True)
class Comparison:
    """The best setting minus another one."""

    other: str
    difference: float
    ci: tuple[float, float]
    """95 % interval, Bonferroni over all others; NaN where replicates are too few or identical."""
    p: float
    """Two-sided, Bonferroni over all others."""
    paired: bool
    """Whether differences were taken replicate by replicate, which share their seeds."""

    @property
    def separated(self) -> bool:
        """Whether the interval lies on the side of the difference, zero left out."""
        return self.ci[0] > 0 or self.ci[1] < 0

    @property
    def tested(self) -> bool:
        """Whether there were enough replicates, with different values, to test."""
        return math.isfinite(self.p)


def group_settings(
    summary: pd.DataFrame, keys: Sequence[str]
) -> list[tuple[dict[str, Any], pd.DataFrame]]:
    """Rows of each combination of swept values, in rising order where all are numbers."""
    if not keys:
        return [({}, summary)] if len(summary) else []
    groups = [
        (dict(zip(keys, values, strict=True)), rows)
        for values, rows in summary.groupby(list(keys), sort=False, dropna=False)
    ]
    if all(pd.api.types.is_numeric_dtype(summary[k]) for k in keys):
        groups.sort(key=lambda group: tuple(group[0].values()))
    return groups


def setting_of(values: dict[str, Any], planned: int, found: pd.Series[float]) -> Setting:
    """Mean, spread and interval of one setting's finished values."""
    n = len(found)
    sd = float(found.std(ddof=1)) if n > 1 else math.nan
    half = float(stats.t.ppf(0.5 + CONFIDENCE / 2, n - 1)) * sd / math.sqrt(n) if n > 1 else sd
    mean = float(found.mean()) if n else math.nan
    return Setting(values, setting_text(values), planned, n, mean, sd, half)


def by_block(
    summary: pd.DataFrame, found: pd.Series[float], over: Sequence[str] = ()
) -> pd.Series[float]:
    """Values by replicate, seed and further keys, or by row where replicates are not told apart."""
    blocks = [c for c in (REPLICATE, SEED, *over) if c in summary]
    if REPLICATE not in blocks:
        return found.rename(index=lambda row: ("row", row))
    rows = summary.loc[found.index, blocks]
    return pd.Series(found.to_numpy(), index=[tuple(r) for r in rows.to_numpy().tolist()])


def compare(
    best: Setting, others: Sequence[Setting], found: Mapping[str, pd.Series[float]]
) -> tuple[Comparison, ...]:
    """The best minus each other setting, nearest first."""
    tests = {o.label: standard_error(found[best.label], found[o.label]) for o in others}
    factor = max(1, sum(t is not None for t in tests.values()))
    results = []
    for other in others:
        difference, test = best.mean - other.mean, tests[other.label]
        if test is None:
            nothing = Comparison(other.label, difference, (math.nan, math.nan), math.nan, False)
            results.append(nothing)
            continue
        error, freedom, paired = test
        reach = float(stats.t.ppf(1 - (1 - CONFIDENCE) / 2 / factor, freedom)) * error
        p = min(1.0, factor * 2 * float(stats.t.sf(abs(difference) / error, freedom)))
        ci = (difference - reach, difference + reach)
        results.append(Comparison(other.label, difference, ci, p, paired))
    return tuple(results)


def standard_error(a: pd.Series[float], b: pd.Series[float]) -> tuple[float, float, bool] | None:
    """Standard error of the difference of means, degrees of freedom, and whether paired.

    None where a side has fewer than two values, or where no spread is left to judge by.
    """
    if len(a) < 2 or len(b) < 2:
        return None
    paired = a.index.is_unique and b.index.is_unique and set(a.index) == set(b.index)
    x = np.asarray(a, dtype=np.float64)
    if paired:
        apart = x - np.asarray(b.reindex(a.index), dtype=np.float64)
        error, freedom = float(apart.std(ddof=1)) / math.sqrt(len(apart)), len(apart) - 1.0
    else:
        y = np.asarray(b, dtype=np.float64)
        u, v = float(x.var(ddof=1)) / len(x), float(y.var(ddof=1)) / len(y)
        error = math.sqrt(u + v)
        freedom = (u + v) ** 2 / (u**2 / (len(x) - 1) + v**2 / (len(y) - 1)) if error else 1.0
    round_off = 1e-12 * max(float(np.abs(x).max()), float(b.abs().max()))
    return (error, freedom, paired) if error > round_off else None
