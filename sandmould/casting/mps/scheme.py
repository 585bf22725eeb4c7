"""What is computed and how: the metal, the choices of the method, and what a pressure has to undo.

Sources of the Poisson equation are compressions: each gives s in Lap p = -c_poi (rho / dt^2) s, so
that the paper's source (6) is s = (n* - n0)/n0. Those made of velocities are rates times dt, and
need the density only to keep the volume.
"""

from __future__ import annotations

from collections.abc import Callable, Collection
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from sandmould.casting.mps.neighbours import Neighbours
from sandmould.casting.mps.operators import (
    GRADIENTS,
    LAPLACIANS,
    density_rate,
    divergence,
    velocity_gradient,
)
from sandmould.casting.mps.particles import Floats, Kernel, Kinds

VISCOUS_SHARE = 0.2
"""Of r0^2/nu, the longest stable explicit step of the viscosity (0.3 on a square lattice)."""

G_M_S2 = 9.8
"""The paper's 1960 Pa under 80 mm mean 9.8."""
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


@dataclass(frozen=True)
class LiquidMetal:
    """A Newtonian fluid under gravity."""

    density_kg_m3: float = 2500.0
    """Molten aluminium, table 1."""
    viscosity_m2_s: float = 1e-5
    """Table 1."""
    gravity_m_s2: tuple[float, float, float] = (0.0, -G_M_S2, 0.0)

    def __post_init__(self) -> None:
        """Refuse what is no fluid."""
        if not self.density_kg_m3 > 0.0:
            raise ValueError(f"density is {self.density_kg_m3} kg/m3: it must be positive")
        if not self.viscosity_m2_s >= 0.0:
            raise ValueError(f"viscosity is {self.viscosity_m2_s} m2/s: it cannot be negative")


@dataclass(frozen=True)
class Scheme:
    """Choices of the method; what is not given is the paper's, at MR5-0.5."""

    dt_max_s: float = 1e-3
    relaxations: int = 5
    """Times the pressure is solved for and positions are corrected in a step; 1 is plain MPS."""
    source_share: float = 0.5
    """c_poi: of the source that one relaxation undoes."""
    source: str = "density"
    """One of ``SOURCES``."""
    gradient: str = "least"
    """One of ``GRADIENTS``."""
    laplacian: str = "lattice"
    """One of ``LAPLACIANS``, for the viscosity."""
    surface: float = 0.985
    """beta, eq. (7): number density over n0 below which a particle is at the surface."""
    courant: float = 0.1
    """C_n, eq. (8)."""
    tolerance: float = 3e-3
    """Of the Poisson equation: residual over source."""
    tension: bool = False
    """Whether pressures below zero are kept, which pull particles together."""
    shifting: float = 0.0
    """Share of r0^2 times the gradient of concentration by which inner particles are moved on after
    a step (Lind et al. 2012), with the velocity found there; 0 for none."""
    collision_distance: float = 0.0
    """Over r0, nearer than which particles that approach collide; 0 for none."""
    restitution: float = 0.2
    """Of these collisions."""

    def __post_init__(self) -> None:
        """Refuse what cannot be run."""
        for name in ("dt_max_s", "courant", "tolerance"):
            value = getattr(self, name)
            if not value > 0.0:
                raise ValueError(f"{name} is {value}: it must be positive")
        if self.relaxations < 1:
            raise ValueError(f"relaxations is {self.relaxations}: at least 1 is needed")
        if not 0.0 < self.source_share <= 1.0:
            raise ValueError(f"source_share is {self.source_share}: valid is above 0 up to 1")
        if not 0.8 <= self.surface <= 1.0:
            raise ValueError(f"surface is {self.surface}: valid is 0.8 to 1")
        if not 0.0 <= self.shifting <= 0.5:
            raise ValueError(f"shifting is {self.shifting}: valid is 0 to 0.5")
        for name in ("collision_distance", "restitution"):
            value = getattr(self, name)
            if not 0.0 <= value <= 1.0:
                raise ValueError(f"{name} is {value}: valid is 0 to 1")
        choices: dict[str, Collection[str]] = {
            "source": SOURCES,
            "gradient": GRADIENTS,
            "laplacian": LAPLACIANS,
        }
        for name, valid in choices.items():
            if getattr(self, name) not in valid:
                raise ValueError(f"{name} is '{getattr(self, name)}': valid are {', '.join(valid)}")
