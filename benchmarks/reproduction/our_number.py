"""A number of ours: what is taken of some rows, with its interval."""

from __future__ import annotations

import math
from dataclasses import dataclass

import pandas as pd

from benchmarks.reproduction.ledger import OurSource
from sandmould.runs.columns import CPU_S, REPLICATE
from sandmould.statistics.settings import setting_of
from sandmould.statistics.verdict import compare_settings


@dataclass(frozen=True)
class OurNumber:
    """What is taken of a record."""

    low: float
    high: float
    """Ends of the 95 % interval of a mean; or the settings next to the best that are ruled out,
    else the ends of the sweep; both the number itself where there is no interval."""
    best: float
    n: int
    """Runs, or rows, that it rests on."""
    cost_s: float = 0.0
    """Processor time of the rows; 0 where they have none."""

    @property
    def half_width(self) -> float:
        """Half of the interval; 0 without one."""
        return (self.high - self.low) / 2


def taken(rows: pd.DataFrame, source: OurSource) -> OurNumber:
    """What is taken of some rows."""
    values = rows[source.column].astype(float)
    if source.size:
        values = values.abs()
    cost = float(rows.loc[~rows.index.duplicated(), CPU_S].sum()) if CPU_S in rows else 0.0
    if source.take == "best":
        verdict = compare_settings(rows, [source.of], source.column)
        best = verdict.best
        if best is None:
            return OurNumber(math.nan, math.nan, math.nan, 0)
        at = best.values[source.of]
        tried = [s.values[source.of] for s in verdict.settings if s.n]
        told_apart = {c.other for c in verdict.comparisons if c.separated}
        # a setting that is ruled out lies outside
        ruled_out = [
            math.nextafter(s.values[source.of], at)
            for s in verdict.settings
            if s.label in told_apart
        ]
        low = max((value for value in ruled_out if value < at), default=min(tried))
        high = min((value for value in ruled_out if value > at), default=max(tried))
        return OurNumber(low, high, at, len(rows), cost)
    if source.take == "where_least":
        at = float(rows[source.of].iloc[int(values.abs().argmin())])
        return OurNumber(at, at, at, len(rows), cost)
    if source.take in ("least", "most"):
        end = float(values.min() if source.take == "least" else values.max())
        return OurNumber(end, end, end, len(rows), cost)
    mean = setting_of({}, len(values), values.dropna())
    # Only replicates scatter by chance; two of them tell no interval worth the name.
    chance = REPLICATE in rows and mean.n > 2 and mean.sd > 0
    half = mean.ci_half_width if chance else 0.0
    return OurNumber(mean.mean - half, mean.mean + half, mean.mean, mean.n, cost)


def less(first: OurNumber, second: OurNumber) -> OurNumber:
    """One number less another, both with independent intervals."""
    half = math.hypot(first.half_width, second.half_width)
    best = first.best - second.best
    n = min(first.n, second.n)
    return OurNumber(best - half, best + half, best, n, first.cost_s + second.cost_s)


def over(first: OurNumber, second: OurNumber) -> OurNumber:
    """One number over another; rates are told without an interval."""
    ratio = first.best / second.best if second.best else math.nan
    n = min(first.n, second.n)
    return OurNumber(ratio, ratio, ratio, n, first.cost_s + second.cost_s)
