"""Pressures of the sand from forces on vertices, eq. (56) of Rojek (2004)."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from pattern_fe.perimeter import Perimeter

Array = NDArray[np.float64]


def vertex_pressure_pa(perimeter: Perimeter, load_n: Array) -> Array:
    """Pressure whose force on a vertex has the load's part along its normal.

    On flat parts it is the normal part of (56), positive in compression; at a corner it is that
    of a uniform pressure, where (56) has too small a value: the vertex's areas face two ways.

    Parameters
    ----------
    perimeter : Perimeter
    load_n : (nv, d) float64, N

    Returns
    -------
    (nv,) float64, Pa
    """
    area = perimeter.vertex_area_vector_m2
    return np.asarray(-np.sum(load_n * area, axis=1) / np.sum(area**2, axis=1))
