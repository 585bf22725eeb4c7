"""How far, how densely and with which voids sand has filled a cavity, and what it can come to."""

from __future__ import annotations

from dataclasses import dataclass
from functools import lru_cache
from weakref import WeakKeyDictionary

import numpy as np
from numpy.typing import NDArray
from scipy.ndimage import distance_transform_edt, label
from scipy.spatial import cKDTree

from sandmould.analysis.free_space import mesh_below_m3, part_in_solid, polygon_below_m2
from sandmould.analysis.intersections import disc_segment_m2, sphere_cap_m3
from sandmould.arrays import Centres, Radii
from sandmould.geometry.geometry import Array, Block, Cavity, Scene, distance_within
from sandmould.geometry.mesh import TriangleMesh
from sandmould.geometry.outline import Outline
from sandmould.geometry.revolved import Revolved
from sandmould.scenario.cavities import CELLS_A_GRAIN, CavityGrid, cavity_grid, drawn_inside

FILLED_SHARE = 0.5
"""Of the bed's solid fraction, from which on a slab of a cavity counts as filled."""
MOST_CELLS = 2_000_000
"""Of the grid that voids are sought on; a cavity of more has wider ones."""
_ROUND_OFF = 1e-9
_MOST_PLACES = 200_000
"""Of the grid on which the middle of a grain is led in."""
_DRAWN = 50_000
"""Places in the box round the cavity: a share of 0.95 comes out to 0.001."""
_RADII = 4
"""Of balls that cover what a grain reaches: from its own down to what the grid tells of it."""
_KNOWN: WeakKeyDictionary[Cavity, dict[float, float]] = WeakKeyDictionary()
"""What was found of each cavity, which belongs to one scene, by the grain: asked at every moment.
"""


@dataclass(frozen=True)
class CavityFill:
    """Sand in one cavity."""

    sand_measure: float
    """m2 in 2D, m3 in 3D: parts of the grains inside the cavity."""
    fill_fraction: float
    """Sand over the measure of the cavity; a dense bed gives its solid fraction, not 1."""
    grains_inside: int
    """Grains whose centre lies inside."""
    filled_depth_m: float
    """Length of the cavity, from its mouth inwards, that is filled; NaN without a bed."""


@dataclass(frozen=True)
class CavityVoids:
    """Spaces of one cavity that hold no sand and would hold a grain."""

    count: int
    """Voids that are not connected with one another."""
    void_fraction: float
    """All of them over the measure of the cavity."""
    largest_measure: float
    """m2 in 2D, m3 in 3D: the largest of them; 0 without any."""


def cavity_fill(
    position_m: Centres, radius_m: Radii, cavity: Cavity, slab_m: float, bed_fraction: float
) -> CavityFill:
    """Measure the sand in a cavity, cut grains counted by the part that lies in it.

    Parts are exact for boxes, polygons and meshes; at a round cavity of radius R they are wrong by
    less than 3e-4 R/r of a grain of radius r. Overlaps of two grains count twice.

    The filled depth is the sum of the slabs across the way inwards that are at least half as
    dense as the bed. There a grain cut by the cavity's border is shared out among slabs as if it
    were whole.

    ``slab_m``, float, m: thickness of the slabs; changed so that a whole number of them makes the
    cavity's length.
    """
    corners_m = cavity.space.corners()
    reach_m = float(radius_m.max(initial=0.0))
    near = (position_m > corners_m.min(axis=0) - reach_m).all(axis=1)
    near &= (position_m < corners_m.max(axis=0) + reach_m).all(axis=1)
    position_m, radius_m = position_m[near], radius_m[near]
    part = part_in_solid(position_m, radius_m, cavity.space)
    inside = distance_within(cavity.space, position_m, 0.0) < 0.0
    sand = float(part.sum())
    slabs = max(1, round(cavity.length_m / slab_m))
    edges_m = np.linspace(0.0, cavity.length_m, slabs + 1)
    share = _share_below(cavity.depth_m(position_m), radius_m, edges_m, position_m.shape[1])
    density = np.diff(part @ share) / np.diff(_space_below(cavity, edges_m))
    filled = density >= FILLED_SHARE * bed_fraction
    return CavityFill(
        sand_measure=sand,
        fill_fraction=sand / cavity.space.measure,
        grains_inside=int(inside.sum()),
        filled_depth_m=cavity.length_m * float(filled.mean()) if bed_fraction > 0.0 else np.nan,
    )


def _share_below(depth_m: Array, radius_m: Array, edges_m: Array, dimension: int) -> Array:
    """Share of each grain that lies less deep than each edge, (n, m); the last holds all."""
    from_edge_m = depth_m[:, None] - edges_m
    radii_m = np.broadcast_to(radius_m[:, None], from_edge_m.shape)
    if dimension == 2:
        share = disc_segment_m2(from_edge_m, radii_m) / (np.pi * radii_m**2)
    else:
        share = sphere_cap_m3(from_edge_m, radii_m) / (4.0 / 3.0 * np.pi * radii_m**3)
    # what of a grain reaches beyond the ends belongs to the end slabs: its part is inside
    share[:, 0], share[:, -1] = 0.0, 1.0
    return share


def _space_below(cavity: Cavity, edges_m: Array) -> Array:
    """Measure of the cavity that lies less deep than each edge, (m,) float64, m2 or m3."""
    space = cavity.space
    if isinstance(space, Block | Revolved):
        return space.measure * edges_m / cavity.length_m
    turned_m = space.vertices_m @ _axes_with_last(cavity.inward).T
    turned_m[:, -1] -= turned_m[:, -1].min()
    if isinstance(space, Outline):
        return polygon_below_m2(turned_m, edges_m)
    return mesh_below_m3(TriangleMesh(space.name, turned_m, space.triangles), edges_m)


def _axes_with_last(direction: Array) -> Array:
    """Right-handed axes of which the last is given, one a row, (d, d) float64."""
    if len(direction) == 2:
        x, y = direction
        return np.array([[y, -x], [x, y]])
    first = np.cross(np.eye(3)[int(np.argmin(np.abs(direction)))], direction)
    first /= np.linalg.norm(first)
    return np.array([first, np.cross(direction, first), direction])


def cavity_voids(
    position_m: Centres, radius_m: Radii, cavity: Cavity, scene: Scene, grain_m: float
) -> CavityVoids:
    """Find the voids of a cavity that are larger than a grain.

    A void is what grains of one size would cover wherever one more could lie in the cavity, clear
    of sand, solids and the cavity's border: the opening of the empty space by a grain. Two places
    belong to one void where such grains would overlap. It is sought on a grid of 16 (2D) or 8 (3D)
    cells along a grain. So its border is known to about half a cell, and one that is wider than a
    grain by less than a cell's diagonal, 9 % of it in 2D and 22 % in 3D, may be passed over.
    """
    grid = _void_grid(cavity, grain_m)
    reach_m = 0.5 * grain_m * (1.0 - _ROUND_OFF)

    def keep_clear(places: NDArray[np.bool_], reach_m: float) -> None:
        points_m = grid.points_m[places]
        clear = _clear_of_sand(points_m, position_m, radius_m, reach_m)
        clear[clear] = scene.clearance_m(points_m[clear], grain_m) >= reach_m
        places[places] = clear

    has_room = grid.inside_m >= reach_m
    keep_clear(has_room, reach_m)
    if not has_room.any():
        return CavityVoids(0, 0.0, 0.0)
    # the outermost of these places lie half a cell, in the mean, within all that there are
    away_m = distance_transform_edt(~has_room, sampling=grid.spacing_m)
    void = (away_m <= 0.5 * (grain_m + grid.spacing_m.mean())) & (grid.inside_m > 0.0)
    keep_clear(void, 0.0)
    number, count = label(void)
    cells = np.bincount(number.ravel())[1:] * grid.spacing_m.prod()
    return CavityVoids(int(count), float(cells.sum()) / cavity.space.measure, float(cells.max()))


def _clear_of_sand(
    points_m: Array, position_m: Array, radius_m: Array, reach_m: float
) -> NDArray[np.bool_]:
    """Which points are farther than a reach from every grain's surface."""
    clear = np.ones(len(points_m), dtype=np.bool_)
    for radius in np.unique(radius_m)[::-1].tolist():
        left = np.flatnonzero(clear)
        if not len(left):
            break
        within_m = radius + reach_m
        nearest_m, _ = cKDTree(position_m[radius_m == radius]).query(
            points_m[left], distance_upper_bound=within_m
        )
        clear[left] = nearest_m >= within_m
    return clear


@lru_cache(maxsize=16)
def _void_grid(cavity: Cavity, grain_m: float) -> CavityGrid:
    """The grid of a cavity, once for all moments of a run."""
    return cavity_grid(cavity, grain_m / CELLS_A_GRAIN[len(cavity.inward)], MOST_CELLS)


def reached_share(cavity: Cavity, scene: Scene, grain_m: float) -> float:
    """Share of a cavity that grains of one size can cover, coming in through its mouth.

    It lacks sharp edges, gaps narrower than the grain, and what lies behind them. A gap that is
    narrower by less than a cell's diagonal, 9 % of the grain in 2D and 22 % in 3D, may pass.
    """
    known = _KNOWN.setdefault(cavity, {})
    if grain_m not in known:
        known[grain_m] = _reached_share(cavity, scene, grain_m)
    return known[grain_m]


def _reached_share(cavity: Cavity, scene: Scene, grain_m: float) -> float:
    dimension = scene.dimension
    grid = cavity_grid(cavity, grain_m / CELLS_A_GRAIN[dimension], _MOST_PLACES, margin_m=grain_m)
    places_m = grid.points_m.reshape(-1, dimension)
    clear_m = scene.clearance_m(places_m, grain_m)
    slack_m = 0.5 * float(np.linalg.norm(grid.spacing_m))
    free = (clear_m >= 0.5 * grain_m - slack_m).reshape(grid.inside_m.shape)
    way = label(free, structure=np.ones((3,) * dimension))[0].ravel()
    before = cavity.depth_m(places_m) < 0.0
    come_in = np.isin(way, np.setdiff1d(way[before], 0))
    drawn_m = drawn_inside(cavity, _DRAWN)
    covered = np.zeros(len(drawn_m), dtype=np.bool_)
    # A place of the grid a little too near to a surface stands for one beside it that touches it.
    for lack_m in slack_m * np.linspace(0.0, 1.0, _RADII):
        middle_m = places_m[come_in & (clear_m >= 0.5 * grain_m - lack_m)]
        reach_m = 0.5 * grain_m - lack_m + slack_m / (_RADII - 1)
        left = np.flatnonzero(~covered)
        nearest_m, _ = cKDTree(middle_m).query(drawn_m[left], distance_upper_bound=reach_m)
        covered[left] = np.isfinite(nearest_m)
    return float((covered & (scene.clearance_m(drawn_m, 0.0) > 0.0)).sum()) / len(drawn_m)
