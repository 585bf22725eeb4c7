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

from sandmould.analysis.bed_density import buried_places
from sandmould.analysis.free_space import free_part
from sandmould.analysis.intersections import disc_lens_m2, sphere_lens_m3
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

    place_m: Array
    """(d,) float64: mean of its places."""
    measure: float
    """Of its places, m2 in 2D or m3 in 3D."""
    solid_fraction: float
    """Mean over its places of the local one."""
    side: Side
    """Where most of its places lie."""


@dataclass(frozen=True)
class LooseSand:
    """Loose sand of a bed."""

    loose_fraction: float
    """Share of the bed's places at which sand lies loose; NaN without places."""
    side_fraction: dict[Side, float]
    """The same of the places on each side of the solids; NaN where there are none."""
    zones: tuple[LooseZone, ...]
    """Those at least as large as a grain, the largest first."""


def find_loose_sand(position_m: Array, radius_m: Array, scene: Scene, grain_m: float) -> LooseSand:
    """Find the zones of loose sand.

    Places are the cells of a grid that lie in free space and at least a ball's radius below the
    surface of the sand there.

    Parameters
    ----------
    position_m : (n, d) float64, m
    radius_m : (n,) float64, m
    scene : Scene
        Its walls must close the box on every side; in 3D they must be upright or level.
    grain_m : float, m
        Diameter of the mass-median grain.
    """
    ball_m, cell_m = 0.5 * BALL_GRAINS * grain_m, grain_m / CELLS_A_GRAIN
    grid, is_buried = buried_places(position_m, radius_m, ball_m, cell_m)
    from_solid_m = _distance_m(scene.solids, grid, 2.0 * ball_m)
    from_wall_m = _distance_m(scene.walls, grid, 2.0 * ball_m)
    clear_m = np.minimum(from_solid_m, from_wall_m)
    is_place = is_buried & (clear_m > 0.0)
    if not is_place.any():
        return LooseSand(np.nan, dict.fromkeys(SIDES, np.nan), ())
    points_m, clear_m = grid[is_place], clear_m[is_place]
    at_places = _local_fraction(points_m, position_m, radius_m, scene, ball_m, clear_m)
    usual = _usual_fraction(at_places, clear_m, ball_m, cell_m)
    local, loose = np.zeros(is_place.shape), np.zeros(is_place.shape, dtype=np.bool_)
    local[is_place], loose[is_place] = at_places, at_places < LOOSE * usual
    side = _sides(from_solid_m, 2.0 * ball_m)
    return LooseSand(
        float(loose[is_place].mean()),
        {
            name: float(loose[at].mean()) if (at := is_place & (side == number)).any() else np.nan
            for number, name in enumerate(SIDES)
        },
        _zones(grid, loose, local, side, cell_m, grain_m),
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
    """On which side of the solids each place lies, as a number into ``SIDES``.

    A place between two solids, one over the other, counts as under the upper one.
    """
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
    cell_m: float,
    grain_m: float,
) -> tuple[LooseZone, ...]:
    """Zones at least as large as a grain, the largest first; ``local`` is 0 where no place is."""
    dimension = grid.shape[-1]
    number, count = label(loose)
    if not count:
        return ()
    cell = cell_m**dimension
    grain = np.pi * grain_m**2 / 4.0 if dimension == 2 else np.pi * grain_m**3 / 6.0
    sizes = np.bincount(number.ravel())
    sizes[0] = 0
    zones = []
    for zone in np.argsort(sizes, kind="stable")[::-1].tolist():
        if sizes[zone] * cell < grain:
            break
        own = number == zone
        most = int(np.argmax(np.bincount(side[own], minlength=len(SIDES))))
        zones.append(
            LooseZone(
                grid[own].mean(axis=0), float(sizes[zone] * cell), float(local[own].mean()),
                SIDES[most],
            )
        )  # fmt: skip
    return tuple(zones)
