"""Weight of a neighbour, eq. (1), and what a regular lattice makes of it."""

from __future__ import annotations

import math
from typing import Any, NamedTuple

import numpy as np

from sandmould.compiled import njit
from sandmould.sums import added

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
