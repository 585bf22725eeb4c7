"""What each cell holds where a drawn surface cuts the grid: volumes that hold the right heat.

The heat of a material is the sum over its cells of volume times temperature at the centre. What a
cut cell holds does not lie about its centre, and a temperature that slopes would be taken at the
wrong place: sand whose first centres lie a whole cell from the metal would take up its heat late.
So what lies off a centre is shared with the next cell of its material, along each axis by the
lever rule. Then the heat of any linear temperature is that of the drawing, as it is on a plain
grid, wherever between the centres the surface lies.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from scipy.ndimage import maximum_filter, minimum_filter

from sandmould.arrays import Flags, Floats, Ints
from sandmould.casting.arpm.raster import CASTING, Raster, inside_solid
from sandmould.scenario.casting.shapes import Body, Pixels

SAMPLES = {2: 256, 3: 64}
"""Points of a cut cell in 2D and 3D at which it is asked what lies there."""
LEAST_SHARE = 0.125
"""Of its cell every element keeps: what a cube's corner holds that just holds the centre."""
CHUNK = 500_000


@dataclass(frozen=True)
class Held:
    """What cells hold of the casting, in C order."""

    share: Floats
    """(n,) float64: of each cell that which lies in the casting."""
    lever: Floats
    """(n, d) float64: share times the distance, in cells, of its middle from the cell's centre."""


def held_of(raster: Raster, solids: Sequence[Body]) -> Held:
    """Of each cell that which lies in the casting, and where.

    Counted at points in each cell beside one of the other material; shares of 0 or 1 and no lever
    in all others. ``raster``: painted with the solids.
    """
    casting = raster.material == CASTING
    near = maximum_filter(casting, 3, mode="nearest") & ~minimum_filter(casting, 3, mode="nearest")
    cells, d, centre = np.flatnonzero(near), casting.ndim, raster.centre_m
    if not any(isinstance(solid, Pixels) for solid in solids):
        # cells that no surface reaches are whole; a picture tells distances too coarsely
        away_m = [np.abs(solid.distance_m(centre[cells])) for solid in solids]
        cells = cells[np.min(away_m, axis=0) <= 0.5 * math.sqrt(d) * raster.cell_m * (1.0 + 1e-9)]
    share, lever = casting.reshape(-1).astype(np.float64), np.zeros((casting.size, d))
    for part in np.array_split(cells, max(1, -(-len(cells) * SAMPLES[d] // CHUNK))):
        off = _even_points(part, d) - 0.5
        place = centre[part][:, None] + off * raster.cell_m
        inside = inside_any(solids, place.reshape(-1, d)).reshape(len(part), -1)
        share[part] = inside.mean(axis=1)
        # about the middle of the points, so that a whole cell has none
        off -= off.mean(axis=1, keepdims=True)
        lever[part] = np.where(inside[:, :, None], off, 0.0).mean(axis=1)
    lever[(share == 0.0) | (share == 1.0)] = 0.0
    return Held(share, lever)


def _even_points(cells: Ints, d: int) -> Floats:
    """Points spread evenly over a unit square or cube for each of some cells, (c, k, d) float64."""
    # Additive recurrence of the root of x^(d+1) = x + 1 (Roberts, 2018): no rows that lie on a
    # slope all at once. It goes on from cell to cell, for a slope may cut all cells alike.
    root = 2.0
    for _ in range(60):
        root = (1.0 + root) ** (1.0 / (d + 1))
    number = cells[:, None] * SAMPLES[d] + np.arange(SAMPLES[d]) + 0.5
    return np.asarray((number[:, :, None] * root ** -np.arange(1.0, d + 1.0)) % 1.0)


def inside_any(solids: Sequence[Body], place_m: Floats) -> Flags:
    """Which places, (n, d) float64, m, some of the solids hold, (n,) bool."""
    found = np.zeros(len(place_m), dtype=np.bool_)
    for solid in solids:
        found[~found] = inside_solid(solid, place_m[~found])
    return found


def volumes(casting: Flags, held: Held, between: tuple[Ints, Ints], area: Floats) -> Floats:
    """What each cell counts for over its own volume, (n,) float64.

    The sum over each material is the drawing's, and so is that of volume times place, but where a
    wall is too thin to share with a next cell or a cell has least to give.

    Parameters
    ----------
    casting : (nx, ny) or (nx, ny, nz) bool
        Whether a cell is of the casting.
    between : two of (f,) int64
        Cells on the low and on the high side of the faces between unlike materials.
    area : (f,) float64
        Of the drawn surface at each of them.
    """
    own = np.where(casting.reshape(-1), held.share, 1.0 - held.share)
    # never so much that less than the least is left
    gives = np.minimum(1.0 - own, 1.0 - LEAST_SHARE)
    giver = np.concatenate(between)
    taker = np.concatenate(between[::-1])
    weight = np.tile(area + 1e-9, 2)
    # where a surface cuts off a cell's corner alone, what lies there goes across edges and corners
    alone = np.setdiff1d(np.flatnonzero(gives), giver)
    far_giver, far_taker = _across_corners(casting, alone)
    giver, taker = np.concatenate([giver, far_giver]), np.concatenate([taker, far_taker])
    weight = np.concatenate([weight, np.ones(len(far_giver))])
    part = weight / np.bincount(giver, weight, len(own))[giver]
    moved = gives[giver] * part
    volume = np.ones(len(own))
    np.add.at(volume, taker, moved)
    np.subtract.at(volume, giver, moved)
    # a whole cell has no lever, so that what is left has that of what went, turned round
    given = np.where(casting.reshape(-1, 1), -held.lever, held.lever)
    given *= (gives / np.where(gives > 0.0, 1.0 - own, 1.0))[:, None]
    lever = -given
    between_m = _places(giver, casting) - _places(taker, casting)
    np.add.at(lever, taker, part[:, None] * given[giver] + moved[:, None] * between_m)
    return _levelled(casting, volume, lever)


def _across_corners(casting: Flags, cells: Ints) -> tuple[Ints, Ints]:
    """Pairs of each cell and all those of the other material that it touches."""
    flat, shape = casting.reshape(-1), np.array(casting.shape)
    place = np.stack(np.unravel_index(cells, casting.shape), axis=1)
    pairs = [(cells[:0], cells[:0])]
    for offset in np.ndindex(*[3] * casting.ndim):
        other = place + np.array(offset) - 1
        there = ((other >= 0) & (other < shape)).all(axis=1)
        number = np.ravel_multi_index(tuple(other[there].T), casting.shape)
        unlike = flat[number] != flat[cells[there]]
        pairs.append((cells[there][unlike], number[unlike]))
    giver, taker = (np.concatenate(part) for part in zip(*pairs, strict=True))
    return giver, taker


def _places(cells: Ints, casting: Flags) -> Floats:
    return np.stack(np.unravel_index(cells, casting.shape), axis=1).astype(np.float64)


def _levelled(casting: Flags, volume: Floats, lever: Floats) -> Floats:
    """Share what lies off the centres with next cells of the same material, by the lever rule."""
    # With both neighbours along an axis one loses half and the other gains half; at a surface the
    # cell itself stands for the one that is not there.
    number, flat = np.arange(casting.size).reshape(casting.shape), casting.reshape(-1)
    moves = []
    for axis in range(casting.ndim):
        cells = np.flatnonzero(lever[:, axis])
        ends, there = [], []
        for side in (-1, 1):
            at = _places(cells, casting).astype(np.int64)
            at[:, axis] = np.clip(at[:, axis] + side, 0, casting.shape[axis] - 1)
            beside = number[tuple(at.T)]
            there.append((flat[beside] == flat[cells]) & (beside != cells))
            ends.append(np.where(there[-1], beside, cells))
        apart = there[0].astype(np.float64) + there[1]
        cells, low, high = (values[apart > 0.0] for values in (cells, *ends))
        amount = lever[cells, axis] / apart[apart > 0.0]
        up = amount > 0.0
        moves.append((np.where(up, low, high), np.where(up, high, low), np.abs(amount)))
    loser, gainer, amount = (np.concatenate(part) for part in zip(*moves, strict=True))
    lost = np.bincount(loser, amount, len(volume))
    spare = np.maximum(volume - LEAST_SHARE, 0.0)
    amount *= np.minimum(1.0, spare[loser] / np.maximum(lost[loser], 1e-300))
    found = volume.copy()
    np.add.at(found, gainer, amount)
    np.subtract.at(found, loser, amount)
    return found
