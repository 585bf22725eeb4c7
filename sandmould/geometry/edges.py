"""Straight edges in a plane: the nearest one to each point, and which points they go round."""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from sandmould.compiled import njit

Array = NDArray[np.float64]


@njit(error_model="numpy")
def nearest_edge_m(point_m: Array, start_m: Array, end_m: Array) -> Array:
    """Distance of points from the nearest of some edges, (n,) float64, m.

    Parameters
    ----------
    point_m : (n, 2) float64, m
    start_m, end_m : (k, 2) float64, m
    """
    found_m = np.empty(len(point_m))
    for i in range(len(point_m)):
        least_m2 = math.inf
        for k in range(len(start_m)):
            along_u, along_v = end_m[k, 0] - start_m[k, 0], end_m[k, 1] - start_m[k, 1]
            from_u, from_v = point_m[i, 0] - start_m[k, 0], point_m[i, 1] - start_m[k, 1]
            share = (from_u * along_u + from_v * along_v) / (along_u * along_u + along_v * along_v)
            share = min(max(share, 0.0), 1.0)
            away_u, away_v = from_u - share * along_u, from_v - share * along_v
            least_m2 = min(least_m2, away_u * away_u + away_v * away_v)
        found_m[i] = math.sqrt(least_m2)
    return found_m


@njit(error_model="numpy")
def is_inside(point_m: Array, start_m: Array, end_m: Array) -> NDArray[np.bool_]:
    """Whether a ray from each point along the second axis meets an odd number of edges, (n,) bool.

    Parameters
    ----------
    point_m : (n, 2) float64, m
    start_m, end_m : (k, 2) float64, m
    """
    inside = np.zeros(len(point_m), dtype=np.bool_)
    for i in range(len(point_m)):
        u, v = point_m[i, 0], point_m[i, 1]
        for k in range(len(start_m)):
            if (start_m[k, 0] > u) != (end_m[k, 0] > u):
                share = (u - start_m[k, 0]) / (end_m[k, 0] - start_m[k, 0])
                if start_m[k, 1] + share * (end_m[k, 1] - start_m[k, 1]) > v:
                    inside[i] = not inside[i]
    return inside
