"""How densely sand lies where nothing disturbs it: the bed's own solid fraction.

Grains line up at walls and solids, a gap beside a part may be all but empty, and the sand's surface
is uneven. So the bed is judged where it lies at least a mass-median grain away from all of these,
and outside the spaces that it should fill.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray
from scipy.ndimage import maximum_filter, minimum_filter
from scipy.spatial import cKDTree

from sandmould.analysis.tube_fill import lies_in_bore
from sandmould.arrays import Centres, Radii
from sandmould.geometry.geometry import Array, Scene

PLACES = 40_000
"""In the box round the sand: a quarter of them tells the fraction to 0.005, were they at random."""
PLACES_A_GRAIN = 2
"""Along the median grain, where the sand is so much that this makes more of them."""
LEAST_GRAINS = 20
"""Squares or cubes round a grain that the undisturbed bed must hold to tell anything."""


def own_solid_fraction(position_m: Centres, radius_m: Radii, scene: Scene, grain_m: float) -> float:
    """Solid fraction of the bed at least a grain away from walls, solids and the sand's surface.

    It is the share of the places of a grid that lie in sand; one in two grains counts twice.

    NaN where less than the space of some twenty grains is so far from all of these.

    ``grain_m``, float, m: diameter of the mass-median grain.
    """
    if not len(position_m):
        return np.nan
    size_m = np.ptp(position_m, axis=0) + grain_m
    cell_m = float(np.prod(size_m) / PLACES) ** (1.0 / len(size_m))
    cell_m = min(cell_m, grain_m / PLACES_A_GRAIN)
    grid, is_buried = buried_places(position_m, radius_m, grain_m, cell_m)
    places_m = grid[is_buried]
    # anywhere in its cell: rows of grains may lie as rows of the grid do
    places_m = places_m + cell_m * np.random.default_rng(0).uniform(-0.5, 0.5, places_m.shape)
    places_m = places_m[scene.clearance_m(places_m, grain_m) >= grain_m]
    for cavity in scene.cavities:
        places_m = places_m[cavity.space.distance_m(places_m) > 0.0]
    for bore in scene.bores:
        places_m = places_m[~lies_in_bore(places_m, bore)]
    if len(places_m) * cell_m ** len(size_m) < LEAST_GRAINS * grain_m ** len(size_m):
        return np.nan
    held = cKDTree(places_m).query_ball_point(position_m, radius_m, return_length=True)
    return float(held.sum()) / len(places_m)


def buried_places(
    position_m: Centres, radius_m: Radii, depth_m: float, cell_m: float
) -> tuple[Array, NDArray[np.bool_]]:
    """Places among all grains, (..., d) float64, m, and which lie so deep below the sand.

    The sand's surface at a place is the lowest within that depth of what the highest grain within
    half of it makes it.
    """
    dimension = position_m.shape[1]
    if not len(position_m):
        return np.zeros((0,) * dimension + (dimension,)), np.zeros((0,) * dimension, dtype=np.bool_)
    low_m, high_m = position_m.min(axis=0), position_m.max(axis=0)
    cells = np.ceil((high_m - low_m) / cell_m).astype(int) + 1
    axes = [low + cell_m * np.arange(n) for low, n in zip(low_m, cells, strict=True)]
    grid = np.stack(np.meshgrid(*axes, indexing="ij"), axis=-1)
    top_m = np.full(cells[:-1], -np.inf)
    column = np.rint((position_m - low_m) / cell_m).astype(int)[:, :-1]
    np.maximum.at(top_m, tuple(column.T), position_m[:, -1] + radius_m)
    reach = max(1, round(depth_m / cell_m))
    top_m = minimum_filter(maximum_filter(top_m, 2 * (reach // 2) + 1), 2 * reach + 1)
    return grid, grid[..., -1] <= top_m[..., None] - depth_m
