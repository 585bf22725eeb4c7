"""How a cavity fills: when a level is reached, and how the gain depends on what is swept."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

FEWEST = 3
"""Points that a limb needs: two make any power law fit."""


@dataclass(frozen=True)
class Limb:
    """A power law ``y ~ x^exponent`` through one side of a curve."""

    exponent: float
    se: float
    """Standard error, widened where the points scatter more than their errors say."""
    points: int


@dataclass(frozen=True)
class Limbs:
    """How a curve rises to its highest point and falls from there."""

    turn: float
    """x of the highest point."""
    rise: Limb | None
    """None where fewer than ``FEWEST`` points lie on that side, the highest included."""
    fall: Limb | None


def fit_limbs(x: ArrayLike, y: ArrayLike, se: ArrayLike) -> Limbs:
    """Fit a power law to either side of the highest point of a curve.

    ``x``, ``y``, ``se``, (n,) float64: all positive: abscissae, values and their standard errors.
    Points with a value that is not positive have no logarithm and are left out.

    Raises
    ------
    ValueError
        Where no value is positive.
    """
    x, y, se = (np.asarray(v, dtype=np.float64) for v in (x, y, se))
    is_measured = np.isfinite(y) & (y > 0)
    if not is_measured.any():
        raise ValueError("no value is positive")
    order = np.argsort(x[is_measured])
    x, y, se = (v[is_measured][order] for v in (x, y, se))
    top = int(y.argmax())
    up, down = slice(0, top + 1), slice(top, len(x))
    return Limbs(
        float(x[top]), _limb(x[up], y[up], se[up]), _limb(x[down], y[down], se[down])
    )  # fmt: skip


def _limb(x: NDArray[np.float64], y: NDArray[np.float64], se: NDArray[np.float64]) -> Limb | None:
    """Weighted least squares of log y over log x."""
    if len(x) < FEWEST:
        return None
    # errors of the logarithm; without any known error all points count alike
    error = np.where(np.isfinite(se) & (se > 0), se / y, np.nan)
    error = np.where(np.isnan(error), np.nanmean(error) if np.isfinite(error).any() else 1.0, error)
    a, b = np.log(x), np.log(y)
    weight = 1.0 / error**2
    middle = np.average(a, weights=weight)
    spread = float(np.sum(weight * (a - middle) ** 2))
    slope = float(np.sum(weight * (a - middle) * b)) / spread
    rest = b - np.average(b, weights=weight) - slope * (a - middle)
    chi2 = float(np.sum(weight * rest**2)) / (len(x) - 2)
    return Limb(slope, math.sqrt(max(1.0, chi2) / spread), len(x))
