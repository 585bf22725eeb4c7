"""Particles of fluid and of mould, and the weight of a neighbour, eq. (1)."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray
from scipy.spatial import cKDTree

from sandmould.arrays import Flags, Floats
from sandmould.compiled import njit
from sandmould.sums import added

Kinds = NDArray[np.int8]

FLUID, WALL, DUMMY = 0, 1, 2
"""Fluid; the mould's innermost layer, which has a pressure; the layers behind it, which only add
to the number density of what is near."""
WALL_LAYERS = 3
"""One of wall and two of dummies fill the kernel of the outermost fluid up to c_k = 3."""
OPTIONS: dict[str, Any] = {
    "nogil": True,
    "error_model": "numpy",
    "fastmath": {"contract", "nsz", "arcp"},
}
"""Fused multiply-add and reciprocals are allowed, no other change of the arithmetic."""
INLINED = OPTIONS | {"forceinline": True}


class Kernel(NamedTuple):
    """The weight function and the lattice it is measured against; compiled code takes it."""

    dimension: int
    spacing_m: float
    """r0, the size of a particle."""
    reach_m: float
    """c_k r0, beyond which nothing weighs."""
    peak: float
    """w at no distance."""
    lattice_density: float
    """n0: number density inside a square or cubic lattice of spacing r0."""
    period_m: tuple[float, float, float]
    """Period along each axis; 0 where there is none."""


@njit(**INLINED)
def weight(kernel: Kernel, r_m: float) -> float:
    """Weight of a neighbour at a distance: a cubic spline, eq. (1)."""
    q = r_m / kernel.reach_m
    if q >= 1.0:
        return 0.0
    if q < 0.5:
        return kernel.peak * (1.0 - 6.0 * q * q * (1.0 - q))
    return kernel.peak * 2.0 * (1.0 - q) ** 3


@njit(**INLINED)
def weight_slope(kernel: Kernel, r_m: float) -> float:
    """Derivative of the weight by the distance, 1/m."""
    q = r_m / kernel.reach_m
    if q >= 1.0:
        return 0.0
    slope = q * (18.0 * q - 12.0) if q < 0.5 else -6.0 * (1.0 - q) ** 2
    return kernel.peak * slope / kernel.reach_m


def make_kernel(
    dimension: int,
    spacing_m: float,
    reach: float = 2.1,
    period_m: tuple[float, float, float] = (0.0, 0.0, 0.0),
) -> Kernel:
    """Weight of particles of one size.

    Eq. (1) is normalised for the plane; in space the same factor stands, since all models divide
    by the lattice's number density.

    Parameters
    ----------
    dimension : int
        2 or 3.
    spacing_m : float, m
        r0.
    reach : float
        c_k; the paper takes 2.1 of the usual 2 to 4.
    period_m : tuple of 3 floats, m
        Of a periodic domain; 0 where there is none.

    Raises
    ------
    ValueError
        For another dimension, a spacing or reach that is no length, or a period in which a
        particle would see itself twice.
    """
    if dimension not in (2, 3):
        raise ValueError(f"dimension is {dimension}: valid are 2 and 3")
    if not spacing_m > 0.0:
        raise ValueError(f"particle size is {spacing_m} m: it must be positive")
    if not 1.5 <= reach <= 4.0:
        raise ValueError(f"kernel size coefficient is {reach}: valid is 1.5 to 4")
    for length_m in period_m:
        if length_m and length_m < 2.0 * reach * spacing_m + spacing_m:
            raise ValueError(
                f"period is {length_m} m: it must be 0 or span two kernels, "
                f"{2.0 * reach * spacing_m + spacing_m:.4g} m"
            )
    bare = Kernel(
        dimension,
        spacing_m,
        reach * spacing_m,
        40.0 / (7.0 * math.pi * reach**2),
        1.0,
        period_m,
    )
    across = np.arange(-math.ceil(reach), math.ceil(reach) + 1)
    site = np.stack(np.meshgrid(*[across] * dimension), axis=-1).reshape(-1, dimension)
    far_m = spacing_m * np.sqrt((site**2).sum(axis=1))
    total = added(weight(bare, float(r)) for r in far_m if r > 0.0)
    return bare._replace(lattice_density=total)


@dataclass
class Particles:
    """State of all particles; fluid moves, the mould keeps its place and velocity."""

    position_m: Floats
    """(n, 3) float64, m."""
    velocity_m_s: Floats
    """(n, 3) float64, m/s; of the mould: what fluid sticks to."""
    kind: Kinds
    """(n,) int8: FLUID, WALL or DUMMY."""

    @property
    def fluid(self) -> Flags:
        """(n,) bool."""
        return self.kind == FLUID

    def joined(self, other: Particles) -> Particles:
        """Both, these first."""
        return Particles(
            np.concatenate((self.position_m, other.position_m)),
            np.concatenate((self.velocity_m_s, other.velocity_m_s)),
            np.concatenate((self.kind, other.kind)),
        )


def at_rest(position_m: Floats, kind: Kinds | int) -> Particles:
    """Particles without velocity; positions may have two or three components."""
    place = np.zeros((len(position_m), 3))
    place[:, : position_m.shape[1]] = position_m
    kinds = np.broadcast_to(np.asarray(kind, dtype=np.int8), len(place)).copy()
    return Particles(place, np.zeros_like(place), kinds)


def lattice(low: tuple[int, ...], high: tuple[int, ...], spacing_m: float) -> Floats:
    """Points of a lattice, half a spacing off the origin, (n, d) float64, m.

    ``low``, ``high``, tuple of d ints: sites run from low to high, high left out.
    """
    axes = [np.arange(a, b) + 0.5 for a, b in zip(low, high, strict=True)]
    return spacing_m * np.stack(np.meshgrid(*axes, indexing="ij"), -1).reshape(-1, len(low))


def mould_around(
    site_m: Floats, is_cavity: Callable[[Floats], Flags], spacing_m: float
) -> Particles:
    """Mould particles behind the surface of a cavity.

    Sites outside the cavity within the mould's layers of it (in the largest component of their
    distance); those touching it, diagonals included, are walls, the rest dummies. ``site_m``,
    (n, d) float64, m: lattice of candidates; it must reach the mould's layers beyond the cavity.
    ``is_cavity``: function of (n, d) float64, m, to (n,) bool.
    """
    inside = is_cavity(site_m)
    outer = site_m[~inside]
    far, _ = cKDTree(site_m[inside]).query(outer, p=np.inf)
    layer = np.round(far / spacing_m)
    within = layer <= WALL_LAYERS
    return at_rest(outer[within], np.where(layer[within] == 1, WALL, DUMMY).astype(np.int8))
