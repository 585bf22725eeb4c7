"""Contact forces of the sand as nodal forces and pressures, eq. (56) of Rojek (2004)."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from pattern_fe.perimeter import Perimeter

Array = NDArray[np.float64]
Indices = NDArray[np.int64]
_OFF = 1e-6
"""A point may lie outside its facet by this share of it: round-off of other programs."""


def vertex_loads_n(perimeter: Perimeter, facet: Indices, point_m: Array, force_n: Array) -> Array:
    """Distribute contact forces to the vertices of facets, f_j = H_j F: right part of (56).

    H_j are the linear shape functions of the facets, so that force and moment are kept.

    Parameters
    ----------
    perimeter : Perimeter
    facet : (m,) int64
        Facet of each contact.
    point_m, force_n : (m, d) float64, m and N
        Contact points on these facets, and forces on the pattern; the normal parts for a pressure.

    Returns
    -------
    (nv, d) float64, N

    Raises
    ------
    ValueError
        When a point lies outside its facet.
    """
    corner = perimeter.vertices_m[perimeter.facets[facet]]
    edges = corner[:, 1:] - corner[:, :1]
    from_first = (point_m - corner[:, 0])[..., None]
    share = np.linalg.solve(edges @ edges.transpose(0, 2, 1), edges @ from_first)[..., 0]
    share = np.concatenate([1.0 - share.sum(axis=1, keepdims=True), share], axis=1)
    outside = np.flatnonzero((share < -_OFF).any(axis=1))
    if len(outside):
        place = ", ".join(f"{x:.4g}" for x in point_m[outside[0]])
        raise ValueError(
            f"{len(outside)} contact points lie outside their facets, one at ({place}) m; "
            "valid are points on them"
        )
    loads = np.zeros_like(perimeter.vertices_m)
    np.add.at(loads, perimeter.facets[facet], share[..., None] * force_n[:, None])
    return loads


def vertex_traction_pa(perimeter: Perimeter, load_n: Array) -> Array:
    """Loads on the vertices over their areas, left part of (56), (nv, d) float64, Pa.

    Parameters
    ----------
    perimeter : Perimeter
    load_n : (nv, d) float64, N
    """
    return np.asarray(load_n / perimeter.vertex_area_m2[:, None])


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
