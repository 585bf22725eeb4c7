"""Share of the free space that is sand: over the height of the box, where nothing disturbs the bed.

Grains line up at walls and solids, a gap beside a part may be all but empty, and the sand's surface
is uneven. So the bed's own fraction is judged where it lies at least a mass-median grain away from
all of these, and outside the spaces that it should fill.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.ndimage import maximum_filter, minimum_filter
from scipy.spatial import cKDTree

from sandmould.analysis.coordination import contacts
from sandmould.analysis.free_space import box_section, free_measure_between
from sandmould.analysis.intersections import disc_segment_m2, sphere_cap_m3
from sandmould.analysis.tube_fill import lies_in_bore
from sandmould.arrays import Centres, Radii
from sandmould.geometry.geometry import Array, Scene

PLACES = 40_000
"""In the box round the sand: a quarter of them tells the fraction to 0.005, were they at random."""
PLACES_A_GRAIN = 2
"""Along the median grain, where the sand is so much that this makes more of them."""
LEAST_GRAINS = 20
"""Squares or cubes round a grain that the undisturbed bed must hold to tell anything."""


@dataclass(frozen=True)
class SolidFractionProfile:
    """Sand and free space in slabs of the box, from the bottom up."""

    edges_m: Array
    """(m + 1,) float64, m: heights between the slabs."""
    sand_measure: Array
    """(m,) float64, m2 in 2D or m3 in 3D."""
    free_measure: Array
    """(m,) float64, m2 in 2D or m3 in 3D: the box without its solids."""
    solid_fraction: Array
    """(m,) float64: sand over free space; NaN where there is no free space."""

    @property
    def height_m(self) -> Array:
        """Middle of each slab, (m,) float64, m."""
        return 0.5 * (self.edges_m[1:] + self.edges_m[:-1])


def solid_fraction_profile(
    position_m: Centres, radius_m: Radii, scene: Scene, edges_m: Array
) -> SolidFractionProfile:
    """Solid fraction of each slab between successive heights.

    A grain cut by the plane between two slabs counts in both with its exact parts; an overlap of
    two grains counts twice. Above the bed's surface the fraction falls to zero: nothing corrects
    for it.

    ``edges_m``, (m + 1,) float64, m: rising heights.

    Raises
    ------
    ValueError
        When the heights do not rise, the box is open at a side, or a wall of 3D is oblique.
    """
    edges_m = np.asarray(edges_m, dtype=np.float64)
    if len(edges_m) < 2 or np.any(np.diff(edges_m) <= 0.0):
        raise ValueError("edges_m must hold two or more rising heights")
    below = np.array([_sand_below(position_m, radius_m, float(h)) for h in edges_m])
    sand = np.diff(below)
    free = free_measure_between(scene, edges_m)
    some = free > 0.0
    fraction = np.where(some, sand / np.where(some, free, 1.0), np.nan)
    return SolidFractionProfile(edges_m, sand, free, fraction)


def mean_solid_fraction(
    position_m: Centres, radius_m: Radii, scene: Scene, low_m: float, high_m: float
) -> float:
    """Solid fraction of the box between two heights; see :func:`solid_fraction_profile`.

    Raises
    ------
    ValueError
        As :func:`solid_fraction_profile`.
    """
    edges_m = np.array([low_m, high_m])
    profile = solid_fraction_profile(position_m, radius_m, scene, edges_m)
    return float(profile.solid_fraction[0])


def bed_surface_height_m(
    position_m: Centres, radius_m: Radii, scene: Scene, column_width_m: float | None = None
) -> float:
    """Height of the bed's surface: the mean over columns of the highest grain top.

    Two things make it robust. A grain in flight, with no other grain, wall or solid within half
    the largest radius, is left out (a dense stream still falling is not told apart). And columns
    weigh alike, so a heap in one counts by its width. Columns without sand are left out: the
    height is that of the surface where there is sand. It lies above the mean of all surface
    grains' tops, the more so the wider the columns.

    ``column_width_m``, float, m: four times the largest radius unless given; stretched to a whole
    number of columns.

    NaN when there is no sand.

    Raises
    ------
    ValueError
        When the box is open at a side, or a wall of a 3D scene is oblique.
    """
    if len(position_m) == 0:
        return float("nan")
    largest_m = float(radius_m.max())
    settled = contacts(position_m, radius_m, scene, tolerance_m=0.5 * largest_m).count > 0
    across_m, top_m = position_m[settled, :-1], (position_m[:, -1] + radius_m)[settled]
    if len(top_m) == 0:
        return float("nan")
    section_m = box_section(scene, *_span(position_m[:, -1], largest_m))[:, : across_m.shape[1]]
    low_m, extent_m = section_m.min(axis=0), np.ptp(section_m, axis=0)
    width_m = 4.0 * largest_m if column_width_m is None else column_width_m
    columns = np.maximum(1, np.floor(extent_m / width_m * (1.0 + 1e-12))).astype(np.int64)
    place = np.floor((across_m - low_m) / extent_m * columns).astype(np.int64)
    place = np.clip(place, 0, columns - 1)
    column = np.ravel_multi_index(tuple(place.T), tuple(columns.tolist()))
    highest_m = np.full(int(columns.prod()), -np.inf)
    np.maximum.at(highest_m, column, top_m)
    return float(highest_m[np.isfinite(highest_m)].mean())


def _span(height_m: Array, margin_m: float) -> tuple[float, float]:
    """Heights that hold all grains."""
    return float(height_m.min()) - margin_m, float(height_m.max()) + margin_m


def _sand_below(position_m: Array, radius_m: Array, height_m: float) -> float:
    """Area (m2) or volume (m3) of the grains' parts under a height."""
    above_m = position_m[:, -1] - height_m
    part = disc_segment_m2 if position_m.shape[1] == 2 else sphere_cap_m3
    return float(part(above_m, radius_m).sum())


def own_solid_fraction(position_m: Centres, radius_m: Radii, scene: Scene, grain_m: float) -> float:
    """Solid fraction of the bed at least a grain away from walls, solids and the sand's surface.

    It is the share of the places of a grid that lie in sand; one in two grains counts twice.

    NaN where less than the space of some twenty grains is so far from all of these. ``grain_m``,
    float, m: diameter of the mass-median grain.
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
