"""Settings of a recorded study as points: how far each one's mean lies from a reference."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from math import hypot, nan, sqrt
from typing import Any, Self

import numpy as np
import pandas as pd

from benchmarks.speed_and_accuracy.method import Point
from sandmould import ROOT
from sandmould.study.collect import read_summary

Named = Callable[[Sequence[Any]], tuple[str, str]]
"""Series and label of a setting from the values of its keys."""


def standard_error(values: pd.Series[float]) -> float:
    """Of a mean; 0 where one run alone tells nothing of it."""
    return values.std() / sqrt(len(values)) if len(values) > 1 else 0.0


class Record:
    """Runs of a record and the measure that its settings are judged by.

    Parameters
    ----------
    name : str
    measure : str
        Column.
    runs : DataFrame, optional
        Those to look at; all by default.
    """

    def __init__(self, name: str, measure: str, runs: pd.DataFrame | None = None) -> None:
        self.name, self.measure = name, measure
        self.page = f"[{name}](results/{name}/README.md)"
        self.runs = read_summary(ROOT / "docs" / "results" / name) if runs is None else runs

    def where(self, key: str, value: Any) -> Self:
        """The runs with a value of a key alone."""
        return type(self)(self.name, self.measure, self.runs[self.runs[key] == value])

    def least(self, key: str) -> Self:
        """The runs with the least value of a key."""
        return self.where(key, self.runs[key].min())

    def split(self, key: str) -> list[Self]:
        """The runs by a key."""
        return [self.where(key, value) for value in sorted(self.runs[key].unique())]

    @property
    def finished(self) -> pd.DataFrame:
        """Runs that ended as planned."""
        return self.runs[self.runs["outcome_code"] == 0]

    @property
    def values(self) -> pd.Series[float]:
        """The measure of those."""
        return self.finished[self.measure]

    def points(
        self, keys: Sequence[str], reference: Record, named: Named, unit: float = 1.0
    ) -> list[Point]:
        """One point a setting: distance of means and its standard error, added in squares.

        Parameters
        ----------
        keys : sequence of str
            Columns that make a setting.
        reference : Record
            What the others are compared with; its own setting has its standard error alone.
        named : callable
        unit : float
            What errors are divided by.
        """
        points = []
        exact = reference.values
        for values, mine in self.runs.groupby(list(keys), dropna=False, sort=False):
            own = Record(self.name, self.measure, mine)
            numbers = own.values
            error = hypot(
                numbers.mean() - exact.mean(), standard_error(numbers), standard_error(exact)
            )
            if numbers.equals(exact):
                error = standard_error(exact) or nan
            cost, memory = own.finished[["cpu_s", "peak_memory_bytes"]].mean()
            points.append(Point(*named(values), cost, error / unit, memory))
            for failure, lost in mine[mine["outcome_code"] != 0].groupby("outcome"):
                cost = lost["cpu_s"].mean()
                points.append(Point(*named(values), cost, nan, failure=str(failure)))
        return points


def together(points: Sequence[Point]) -> Point:
    """One setting in several scenes: mean time, root mean square error."""
    errors = np.array([point.error for point in points])
    cost = float(np.mean([point.core_s for point in points]))
    return points[0]._replace(core_s=cost, error=float(np.sqrt(np.mean(errors**2))))
