"""Pressures of the sand from forces on vertices, eq. (56) of Rojek (2004)."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from sandmould.pattern_fe.perimeter import Perimeter

Array = NDArray[np.float64]
_FACING = 0.5
"""Part of a vertex's area vector along the vertical from which on it faces up or down."""


def vertex_pressure_pa(perimeter: Perimeter, load_n: Array) -> Array:
    """Pressure whose force on a vertex has the load's part along its normal, (nv,) float64, Pa.

    On flat parts it is the normal part of (56), positive in compression; at a corner it is that of
    a uniform pressure, where (56) has too small a value: the vertex's areas face two ways.
    ``load_n``: (nv, d) float64, N.
    """
    area = perimeter.vertex_area_vector_m2
    return np.asarray(-np.sum(load_n * area, axis=1) / np.sum(area**2, axis=1))


def pressure_above_and_below_pa(
    perimeter: Perimeter, load_n: Array, free: NDArray[np.bool_]
) -> tuple[float, float]:
    """Vertical load of the sand on what faces up and on what faces down, over its area.

    Over a flange the first may be more than the weight of the sand above it, where the bed beside
    it settles and hangs on that sand; the second is what sand under it gives back.

    Pa, positive in compression; NaN where nothing faces that way.

    Parameters
    ----------
    perimeter : Perimeter
        As drawn.
    load_n : (nv, d) float64, N
    free : (nv,) bool
        Vertices that nothing holds; sand presses on no other.
    """
    area = perimeter.vertex_area_vector_m2
    along = area[:, -1] / np.linalg.norm(area, axis=1)
    above, below = (
        -float((load_n[at, -1]).sum()) / float(area[at, -1].sum()) if at.any() else np.nan
        for at in (free & (along > _FACING), free & (along < -_FACING))
    )
    return above, below
