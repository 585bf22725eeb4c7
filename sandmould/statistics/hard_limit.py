"""What a measure would be with grains of no overlap: its limit in 1/kappa, where it has one.

Overlaps shrink as 1/kappa, and packing, density and angles go with them. A frequency has no such
limit: an optimum that follows the springs moves with them at any kappa.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.special import chdtrc, stdtrit

from sandmould.statistics.mean_tests import CONFIDENCE

Array = NDArray[np.float64]
LEAST_LEVELS = 4
"""Of kappa: three of them lie on a parabola through anything."""


@dataclass(frozen=True)
class HardLimit:
    """The limit of a measure for hard grains, or why there is none."""

    value: float
    """NaN without a limit."""
    half_width: float
    """Of its 95 % interval."""
    why_not: str
    """A few words; empty where there is a limit."""


def extrapolate(kappa: Array, mean: Array, error: Array) -> HardLimit:
    """Extrapolate a measure in 1/kappa, where at least four levels are monotone.

    They are where a rising or a falling sequence lies within all their 95 % intervals. The line
    through them is that of weighted least squares; levels that lie off it by more than their
    errors explain, at 95 %, have no limit that a line can tell.

    Parameters
    ----------
    kappa : (n,) float64
        Different ones.
    mean, error : (n,) float64, in the unit of the measure
        Of each level, with its standard error.

    Returns
    -------
    HardLimit
    """
    order = np.argsort(kappa)
    x, y, se = 1.0 / kappa[order], mean[order], error[order]
    if len(x) < LEAST_LEVELS or not (np.isfinite(y).all() and (se > 0.0).all()):
        return _none(f"fewer than {LEAST_LEVELS} levels of kappa with a mean and its error")
    normal = float(stdtrit(math.inf, 0.5 + CONFIDENCE / 2))
    if not (_may_rise(y, normal * se) or _may_rise(-y, normal * se)):
        return _none("levels that are not monotone within their intervals")
    parts = np.column_stack([np.ones_like(x), x]) / se[:, None]
    covariance = np.linalg.inv(parts.T @ parts)
    fitted = covariance @ parts.T @ (y / se)
    freedom = len(x) - 2
    squares = float(((y / se - parts @ fitted) ** 2).sum())
    if float(chdtrc(freedom, squares)) < 1.0 - CONFIDENCE:
        return _none("levels that are not on a line in 1/kappa")
    # Scatter beyond the errors widens the interval, as far as it is not told from chance.
    wider = max(1.0, math.sqrt(squares / freedom))
    return HardLimit(float(fitted[0]), normal * wider * math.sqrt(float(covariance[0, 0])), "")


def _may_rise(y: Array, reach: Array) -> bool:
    """Whether a sequence that never falls lies within all intervals."""
    return bool((np.maximum.accumulate(y - reach) <= y + reach).all())


def _none(why: str) -> HardLimit:
    return HardLimit(math.nan, math.nan, why)
