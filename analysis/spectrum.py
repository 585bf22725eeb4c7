"""Curves over what is swept: the response of a bed to a small shake, and how a cavity fills.

A bed's own resonances are told from the loads on its box.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

Array = NDArray[np.float64]
PEAK = 1.2
"""Amplification from which a highest response counts as a resonance: a rigid bed has 1."""
FEWEST = 3
"""Points that a limb needs: two make any power law fit."""


def transfer(
    time_s: Array, force_n: Array, frequency_hz: float, window_s: float, rigid_n: float
) -> float:
    """Amplitude of a force at one frequency over that of a rigid bed, from its second half.

    NaN where less than one period is left to fit.

    Parameters
    ----------
    time_s : (n,) float64, s
        Ends of the windows over which the force is a mean.
    force_n : (n,) float64, N
    rigid_n : float, N
        Mass of the bed times the amplitude of its box's acceleration.
    """
    late = time_s >= 0.5 * (time_s[0] + time_s[-1])
    if np.ptp(time_s[late]) * frequency_hz < 1.0:
        return float("nan")
    phase = 2 * np.pi * frequency_hz * (time_s[late] - 0.5 * window_s)
    parts = np.column_stack([np.sin(phase), np.cos(phase), np.ones_like(phase)])
    sine, cosine, _ = np.linalg.lstsq(parts, force_n[late])[0]
    # A mean over a window has this share of the amplitude.
    seen = float(np.sinc(frequency_hz * window_s))
    return float(np.hypot(sine, cosine)) / seen / rigid_n


def first_resonance_hz(frequency_hz: Array, response: Array) -> float:
    """The lowest frequency whose response is higher than its neighbours', and amplified.

    Of the parabola through the highest and its neighbours, over logarithms; NaN where the bed
    amplifies nothing between the ends. ``frequency_hz``, ``response``: (n,) float64.
    """
    x = np.log(frequency_hz)
    for i in range(1, len(x) - 1):
        near = response[i - 1 : i + 2]
        if np.isfinite(near).all() and near[1] == near.max() and near[1] > PEAK:
            a, b, _ = np.polyfit(x[i - 1 : i + 2] - x[i], near, 2)
            top = -0.5 * b / a if a < 0 else 0.0
            return float(np.exp(x[i] + top))
    return float("nan")


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
