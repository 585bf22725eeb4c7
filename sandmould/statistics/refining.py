"""What sizes of elements or steps say together: the value towards none at all, and its error."""

from __future__ import annotations

import itertools
import math
from collections.abc import Sequence
from dataclasses import dataclass

import scipy

RESOLUTIONS = (
    "element_m", "particle_m", "dt_max_s", "step_s", "time_step.fraction",
    "time_step.bed_fraction",
)  # fmt: skip
"""Ends of keys whose smaller values only compute the same more finely."""
APART = 1.1
"""Ratio of two sizes from which on one is finer than the other."""
ORDERS = (0.5, 6.0)
"""Observed orders of convergence that are regular."""


@dataclass(frozen=True)
class Refining:
    """Values of a measure at sizes of a resolution, the coarsest first."""

    key: str
    sizes: tuple[float, ...]
    values: tuple[float, ...]

    @property
    def order(self) -> float:
        """Observed order of convergence; NaN unless the three finest levels are regular."""
        if len(self.sizes) < 3:
            return math.nan
        (h1, h2, h3), (f1, f2, f3) = self.sizes[-3:], self.values[-3:]
        first, second = f2 - f1, f3 - f2
        if second == 0.0:
            return math.nan

        def misfit(order: float) -> float:
            """Of the two steps to those of an error that goes with this power of the size."""
            return (h1**order - h2**order) / (h2**order - h3**order) - first / second

        low, high = ORDERS
        if misfit(low) * misfit(high) > 0.0:
            return math.nan
        return float(scipy.optimize.brentq(misfit, low, high))

    @property
    def value(self) -> float:
        """Extrapolated to no size at all where three levels are regular, else the finest."""
        if math.isnan(self.order):
            return self.values[-1]
        gain = (self.sizes[-2] / self.sizes[-1]) ** self.order - 1.0
        return self.values[-1] + (self.values[-1] - self.values[-2]) / gain

    @property
    def error(self) -> float:
        """Half width: what was extrapolated, or the largest of the last two steps of the values."""
        if not math.isnan(self.order):
            return abs(self.value - self.values[-1])
        steps = [abs(b - a) for a, b in itertools.pairwise(self.values)]
        return max(steps[-2:])


def resolution_among(keys: Sequence[str]) -> str:
    """The one of some swept keys that only computes more finely; empty where none or several do."""
    found = [key for key in keys if key.endswith(RESOLUTIONS)]
    return found[0] if len(found) == 1 else ""


def refining_of(key: str, at: Sequence[tuple[float, float]]) -> Refining | None:
    """Order sizes and their values; None where no two sizes are apart.

    ``at``, sequence of (float, float): size and value of each level.
    """
    ordered = sorted((pair for pair in at if math.isfinite(pair[1])), reverse=True)
    sizes, values = tuple(size for size, _ in ordered), tuple(value for _, value in ordered)
    if len(sizes) < 2 or any(a < APART * b for a, b in itertools.pairwise(sizes)):
        return None
    return Refining(key, sizes, values)
