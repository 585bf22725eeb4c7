"""Where sand lies loose round what is buried in it.

The local solid fraction is that of a ball (a disc in 2D) three mass-median grains across: the
sand in it over its free space, both exact. A place is loose where this is below 0.9 of what the
bed has in the median as far from the nearest surface: at a flat wall grains line up, so that every
wall, also one that sand has packed against well, has less sand within half a grain than the bed.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal

import numpy as np
from numpy.typing import NDArray
from scipy.ndimage import label
from scipy.spatial import cKDTree

from sandmould.analysis.free_space import free_part
from sandmould.analysis.intersections import disc_lens_m2, sphere_lens_m3
from sandmould.analysis.solid_fraction import buried_places
from sandmould.analysis.tube_fill import lies_in_bore
from sandmould.arrays import Centres, Radii
from sandmould.geometry.geometry import Array, Scene, Solid, Wall, distance_within

LOOSE = 0.9
"""Of the bed's solid fraction, below which sand lies loose."""
BALL_GRAINS = 3.0
"""Diameter of the ball over the grain's: some sixteen spheres lie in it."""
CELLS_A_GRAIN = 2
"""Cells of the grid along a grain, of any dimension."""
_CHUNK = 20_000
"""Balls in memory together."""

Side = Literal["under", "over", "beside", "away"]
"""Where a zone lies: straight under or over a solid or beside it, within a ball's diameter; or
farther away."""
SIDES: tuple[Side, ...] = ("under", "over", "beside", "away")


@dataclass(frozen=True)
class LooseZone:
    """Places that hang together at which sand lies loose."""

    low_m: Array
    high_m: Array
    """(d,) float64: ends of its places along each axis. A mean may lie inside a wall that the zone
    goes round."""
    measure: float
    """Of its places, m2 in 2D or m3 in 3D."""
    solid_fraction: float
    """Mean over its places of the local one."""
    side: Side
    """Where most of its places lie."""
    near: str
    """The tube or cavity that holds most of them, else the solid nearest to most of them."""
    is_inside: bool
    """Whether it lies in that tube or cavity."""


@dataclass(frozen=True)
class LooseField:
    """Local solid fraction over what is usual as far from a surface, on a grid."""

    low_m: Array
    """(d,) float64: its first place."""
    cell_m: float
    share: Array
    """(nx, ..., nz) float64; NaN where no place is."""
    zone: NDArray[np.int32]
    """The same shape: 1 for a place of the first zone, and so on; 0 outside of all."""


@dataclass(frozen=True)
class LooseSand:
    """Loose sand of a bed."""

    loose_fraction: float
    """Share of the bed's places at which sand lies loose; NaN without places."""
    side_fraction: dict[Side, float]
    """The same of the places on each side of the solids; NaN where there are none."""
    zones: tuple[LooseZone, ...]
    """Those at least as large as a grain, the largest first."""
    field: LooseField


def find_loose_sand(
    position_m: Centres, radius_m: Radii, scene: Scene, grain_m: float
) -> LooseSand:
    """Find the zones of loose sand.

    Places are the cells of a grid that lie in free space and at least a ball's radius below the
    surface of the sand there. ``scene``: its walls must close the box on every side; in 3D they
    must be upright or level. ``grain_m``: diameter of the mass-median grain.
    """
    ball_m, cell_m = 0.5 * BALL_GRAINS * grain_m, grain_m / CELLS_A_GRAIN
    grid, is_buried = buried_places(position_m, radius_m, ball_m, cell_m)
    from_solid_m = _distance_m(scene.solids, grid, 2.0 * ball_m)
    from_wall_m = _distance_m(scene.walls, grid, 2.0 * ball_m)
    clear_m = np.minimum(from_solid_m, from_wall_m)
    is_place = is_buried & (clear_m > 0.0)
    if not is_place.any():
        share, zone = np.full(is_place.shape, np.nan), np.zeros(is_place.shape, dtype=np.int32)
        nothing = LooseField(np.zeros(grid.shape[-1]), cell_m, share, zone)
        return LooseSand(np.nan, dict.fromkeys(SIDES, np.nan), (), nothing)
    points_m, clear_m = grid[is_place], clear_m[is_place]
    at_places = _local_fraction(points_m, position_m, radius_m, scene, ball_m, clear_m)
    usual = _usual_fraction(at_places, clear_m, ball_m, cell_m)
    local, loose = np.zeros(is_place.shape), np.zeros(is_place.shape, dtype=np.bool_)
    local[is_place], loose[is_place] = at_places, at_places < LOOSE * usual
    share = np.full(is_place.shape, np.nan)
    share[is_place] = at_places / usual
    side = _sides(from_solid_m, 2.0 * ball_m)
    zones, zone = _zones(grid, loose, local, side, grain_m, scene)
    return LooseSand(
        float(loose[is_place].mean()),
        {
            name: float(loose[at].mean()) if (at := is_place & (side == number)).any() else np.nan
            for number, name in enumerate(SIDES)
        },
        zones,
        LooseField(grid.reshape(-1, grid.shape[-1])[0], cell_m, share, zone),
    )


def _distance_m(surfaces: tuple[Wall | Solid, ...], grid: Array, reach_m: float) -> Array:
    """Distance of places from the nearest surface, negative inside; exact up to a reach."""
    points_m = grid.reshape(-1, grid.shape[-1])
    nearest_m = np.full(len(points_m), np.inf)
    for surface in surfaces:
        np.minimum(nearest_m, distance_within(surface, points_m, reach_m), out=nearest_m)
    return nearest_m.reshape(grid.shape[:-1])


def _local_fraction(
    points_m: Array, position_m: Array, radius_m: Array, scene: Scene, ball_m: float, clear_m: Array
) -> Array:
    """Sand in the ball round each point over its free space, (k,) float64."""
    lens, whole = (
        (disc_lens_m2, np.pi * ball_m**2)
        if scene.dimension == 2
        else (sphere_lens_m3, 4.0 / 3.0 * np.pi * ball_m**3)
    )
    tree, reach_m = cKDTree(position_m), ball_m + float(radius_m.max())
    sand, free = np.zeros(len(points_m)), np.full(len(points_m), whole)
    for at in range(0, len(points_m), _CHUNK):
        own = slice(at, at + _CHUNK)
        pairs = cKDTree(points_m[own]).sparse_distance_matrix(tree, reach_m, output_type="ndarray")
        radii_m = radius_m[pairs["j"]]
        part = lens(pairs["v"], np.full(len(radii_m), ball_m), radii_m)
        sand[own] = np.bincount(pairs["i"], weights=part, minlength=len(points_m[own]))
    cut = np.flatnonzero(clear_m < ball_m)
    free[cut] = free_part(points_m[cut], np.full(len(cut), ball_m), scene)
    # the middle of a ball lies in free space, so that some of it is free
    return sand / np.maximum(free, 1e-9 * whole)


def _usual_fraction(local: Array, clear_m: Array, ball_m: float, cell_m: float) -> Array:
    """Median over all places as far from the nearest surface, for each place, (k,) float64."""
    shell = np.minimum(clear_m, ball_m) // cell_m
    usual = np.empty(len(local))
    for number in np.unique(shell):
        usual[shell == number] = np.median(local[shell == number])
    return usual


def _sides(from_solid_m: Array, near_m: float) -> NDArray[np.int8]:
    """On which side of the solids each place lies, as a number into ``SIDES``."""
    # A place between two solids, one over the other, counts as under the upper one.
    inside = from_solid_m <= 0.0
    up = np.logical_or.accumulate(inside[..., ::-1], axis=-1)[..., ::-1]
    down = np.logical_or.accumulate(inside, axis=-1)
    side = np.full(from_solid_m.shape, SIDES.index("beside"), dtype=np.int8)
    side[down] = SIDES.index("over")
    side[up] = SIDES.index("under")
    side[from_solid_m >= near_m] = SIDES.index("away")
    return side


def _zones(
    grid: Array,
    loose: NDArray[np.bool_],
    local: Array,
    side: NDArray[np.int8],
    grain_m: float,
    scene: Scene,
) -> tuple[tuple[LooseZone, ...], NDArray[np.int32]]:
    """Zones at least as large as a grain, the largest first, and the zone of each place."""
    # local is 0 where no place is
    dimension, cell_m = grid.shape[-1], grain_m / CELLS_A_GRAIN
    number, _ = label(loose)
    cell = cell_m**dimension
    grain = np.pi * grain_m**2 / 4.0 if dimension == 2 else np.pi * grain_m**3 / 6.0
    sizes = np.bincount(number.ravel())
    sizes[0] = 0
    zones, of_place = [], np.zeros(loose.shape, dtype=np.int32)
    for zone in np.argsort(sizes, kind="stable")[::-1].tolist():
        if sizes[zone] * cell < grain:
            break
        own = number == zone
        points_m = grid[own]
        most = int(np.argmax(np.bincount(side[own], minlength=len(SIDES))))
        ends_m = points_m.min(axis=0), points_m.max(axis=0)
        means = float(sizes[zone] * cell), float(local[own].mean())
        zones.append(LooseZone(*ends_m, *means, SIDES[most], *_near(points_m, scene)))
        of_place[own] = len(zones)
    return tuple(zones), of_place


def _near(points_m: Array, scene: Scene) -> tuple[str, bool]:
    """The space that holds most of the points, else the solid nearest to most; and whether."""
    for bore in scene.bores:
        if lies_in_bore(points_m, bore).mean() > 0.5:
            return bore.name, True
    for cavity in scene.cavities:
        if (cavity.space.distance_m(points_m) < 0.0).mean() > 0.5:
            return cavity.name, True
    if not scene.solids:
        return "", False
    apart_m = np.stack([solid.distance_m(points_m) for solid in scene.solids])
    nearest = np.bincount(np.argmin(apart_m, axis=0), minlength=len(scene.solids))
    return scene.solids[int(np.argmax(nearest))].name, False
