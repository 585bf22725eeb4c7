"""Sources of the Poisson equation: the compression that a pressure is asked to undo.

Each gives s in Lap p = -c_poi (rho / dt^2) s, so that the paper's source (6) is s = (n* - n0)/n0.
Those made of velocities are rates times dt, and need the density only to keep the volume.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import NamedTuple

import numpy as np

from sandmould.casting.mps.neighbours import Neighbours
from sandmould.casting.mps.operators import density_rate, divergence, velocity_gradient
from sandmould.casting.mps.particles import Floats, Kinds
from sandmould.casting.mps.weight import Kernel

DENSITY_SHARE = 0.01
"""Of the density's error that ``divergence`` undoes in a step; Tanaka and Masunaga 2010 take
0.001 to 0.05."""


class Tentative(NamedTuple):
    """Particles between prediction and correction."""

    kernel: Kernel
    near: Neighbours
    kind: Kinds
    velocity_m_s: Floats
    dt_s: float
    compression: Floats
    """(n,) float64: (n* - n0)/n0."""
    compression_before: Floats
    """(n,) float64: the same at the beginning of the step."""
    rate_before: Floats
    """(n,) float64, 1/s: rate of the number density over n0 at the beginning of the step."""


def density(now: Tentative) -> Floats:
    """The paper's source, eq. (6)."""
    return now.compression


def divergence_and_density(now: Tentative) -> Floats:
    """Divergence of the velocity and a small share of the density (Tanaka and Masunaga 2010)."""
    rate = divergence(now.kernel, now.near, now.velocity_m_s)
    return DENSITY_SHARE * now.compression_before - now.dt_s * rate


def corrected_divergence(now: Tentative) -> Floats:
    """Divergence of the velocity, exact for a linear one on any positions.

    For flows without a free surface: nothing keeps the volume but shifting.
    """
    gradient = velocity_gradient(now.kernel, now.near, now.velocity_m_s, now.kind)
    return np.asarray(-now.dt_s * gradient.trace(axis1=1, axis2=2))


def higher_order(now: Tentative) -> Floats:
    """Rate of the number density, HS (Khayyer and Gotoh 2009); nothing keeps the volume."""
    rate = density_rate(now.kernel, now.near, now.velocity_m_s)
    return now.dt_s / now.kernel.lattice_density * rate


def error_compensating(now: Tentative) -> Floats:
    """HS and the errors so far, each weighted by the other, ECS (Khayyer and Gotoh 2011)."""
    drift = now.dt_s * now.rate_before
    error = now.compression_before
    return higher_order(now) + np.abs(error) * drift + np.abs(drift) * error


SOURCES: dict[str, Callable[[Tentative], Floats]] = {
    "density": density,
    "divergence": divergence_and_density,
    "corrected_divergence": corrected_divergence,
    "higher_order": higher_order,
    "error_compensating": error_compensating,
}
