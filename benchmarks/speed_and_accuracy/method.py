"""What a chart shows: settings of a method, the best of them, and those that failed."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from math import isfinite, nan
from typing import NamedTuple


class Point(NamedTuple):
    """One setting."""

    series: str
    label: str
    core_s: float
    """Time of one core."""
    error: float
    """In the panel's unit; NaN if the setting failed."""
    memory_bytes: float = nan
    failure: str = ""
    """Why it has no error."""


@dataclass(frozen=True)
class Panel:
    """Settings that can be compared.

    Parameters
    ----------
    title, error : str
        Above the panel, and at its axis of errors.
    points : sequence of Point
    records : sequence of str
        What the points are read from, as the page names it.
    cost : str
        At its axis of time.
    fails_below_s : float, s
        Core time below which the stability limit is passed.
    """

    title: str
    error: str
    points: Sequence[Point]
    records: Sequence[str]
    cost: str = "core time of a run, s"
    fails_below_s: float = 0.0
    is_logarithmic: bool = True

    @property
    def good(self) -> list[Point]:
        """Settings with an error, cheapest first."""
        return sorted((p for p in self.points if isfinite(p.error)), key=lambda p: p[2:4])

    @property
    def failed(self) -> list[Point]:
        """Settings that ended without an answer."""
        return [p for p in self.points if p.failure]

    @property
    def front(self) -> list[Point]:
        """Settings that no other one beats in both time and error (Pareto)."""
        best: list[Point] = []
        for point in self.good:
            if not best or point.error < best[-1].error:
                best.append(point)
        return best


@dataclass(frozen=True)
class Method:
    """Panels of one chart; ``name`` is that of its picture."""

    name: str
    panels: Sequence[Panel]
