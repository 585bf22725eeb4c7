"""Neighbours: candidates kept while particles move less than half a skin, and those in reach."""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray
from scipy.spatial import cKDTree

from sandmould.arrays import Floats, Ints
from sandmould.casting.mps.particles import DUMMY, INLINED, OPTIONS, Kernel, Kinds, weight
from sandmould.compiled import njit

SKIN = 0.35
"""Over the particle size. Wider lists last longer, and each pass over them costs more."""


class VerletList(NamedTuple):
    """Particles that may come within the kernel of each other, both ways round."""

    start: Ints
    """(n + 1,) int64: candidates of particle i are start[i] to start[i + 1]."""
    other: NDArray[np.uint32]
    """(p,) uint32: rising within each row, so that no sum depends on when the list was made."""
    listed_m: Floats
    """(n, 3) float64, m: positions that the list was made at."""


class Neighbours(NamedTuple):
    """Particles within the kernel of fluid and walls at given positions; dummies have none."""

    start: Ints
    """(n + 1,) int64: neighbours of particle i are start[i] to start[i + 1]."""
    other: NDArray[np.uint32]
    """(e,) uint32."""
    away_m: Floats
    """(e, 3) float64, m: from particle i to the nearest image of its neighbour."""
    share: Floats
    """(e,) float64, 1/m2: w / r^2."""
    density: Floats
    """(n,) float64: number density, eq. (2); 0 for dummies."""


@njit(**OPTIONS)
def _both_ways(n: int, pair: Ints, kind: Kinds) -> tuple[Ints, NDArray[np.uint32]]:
    """Rows of candidates from pairs, in rising order; dummies need none of each other."""
    start = np.zeros(n + 1, dtype=np.int64)
    for k in range(len(pair)):
        i, j = pair[k, 0], pair[k, 1]
        if kind[i] != DUMMY or kind[j] != DUMMY:
            start[i + 1] += 1
            start[j + 1] += 1
    for i in range(n):
        start[i + 1] += start[i]
    place = start[:-1].copy()
    mixed = np.empty(start[n], dtype=np.uint32)
    for k in range(len(pair)):
        i, j = pair[k, 0], pair[k, 1]
        if kind[i] != DUMMY or kind[j] != DUMMY:
            mixed[place[i]] = j
            mixed[place[j]] = i
            place[i] += 1
            place[j] += 1
    # whoever has i as a candidate is one of i: handing i out row after row sorts the rows
    other = np.empty(start[n], dtype=np.uint32)
    place = start[:-1].copy()
    for i in range(n):
        for k in range(start[i], start[i + 1]):
            j = mixed[k]
            other[place[j]] = i
            place[j] += 1
    return start, other


def find_candidates(kernel: Kernel, position_m: Floats, kind: Kinds) -> VerletList:
    """List candidates. ``position_m``, (n, 3) float64, m: finite. ``kind``: (n,) int8."""
    period = np.asarray(kernel.period_m)
    cyclic = period > 0.0
    wrapped = position_m.copy()
    wrapped[:, cyclic] = np.mod(wrapped[:, cyclic], period[cyclic])
    # mod rounds a tiny negative number up to the period itself, which the tree refuses
    wrapped[:, cyclic] = np.where(wrapped[:, cyclic] < period[cyclic], wrapped[:, cyclic], 0.0)
    tree = cKDTree(wrapped, boxsize=period if cyclic.any() else None, balanced_tree=False)
    reach_m = kernel.reach_m + SKIN * kernel.spacing_m
    pair = tree.query_pairs(reach_m, output_type="ndarray")
    start, other = _both_ways(len(position_m), pair, kind)
    return VerletList(start, other, position_m.copy())


@njit(**OPTIONS)
def list_is_old(kernel: Kernel, listed: Floats, position: Floats) -> bool:
    """Whether a particle moved more than half a skin since the list was made."""
    limit = (0.5 * SKIN * kernel.spacing_m) ** 2
    for i in range(len(position)):
        moved = 0.0
        for a in range(3):
            moved += (position[i, a] - listed[i, a]) ** 2
        if moved > limit:
            return True
    return False


@njit(**INLINED)
def _nearest(apart: float, period: float) -> float:
    """Distance along an axis to the nearest image."""
    return apart - period * np.rint(apart / period) if period > 0.0 else apart


@njit(**OPTIONS)
def find_neighbours(
    kernel: Kernel, listed: VerletList, position: Floats, kind: Kinds
) -> Neighbours:
    """Pick the neighbours out of the candidates and weigh them.

    Parameters
    ----------
    listed : VerletList
        Not old.
    position : (n, 3) float64, m
    kind : (n,) int8
    """
    n, most = len(position), len(listed.other)
    start = np.zeros(n + 1, dtype=np.int64)
    other = np.empty(most, dtype=np.uint32)
    away = np.empty((most, 3))
    distance2 = np.empty(most)
    reach2 = kernel.reach_m**2
    period = kernel.period_m
    e = 0
    for i in range(n):
        if kind[i] != DUMMY:
            x, y, z = position[i, 0], position[i, 1], position[i, 2]
            for k in range(listed.start[i], listed.start[i + 1]):
                j = listed.other[k]
                dx = _nearest(position[j, 0] - x, period[0])
                dy = _nearest(position[j, 1] - y, period[1])
                dz = _nearest(position[j, 2] - z, period[2])
                r2 = dx * dx + dy * dy + dz * dz
                # written in any case, kept in reach: no processor could predict the branch
                other[e] = j
                away[e, 0], away[e, 1], away[e, 2] = dx, dy, dz
                distance2[e] = r2
                e += r2 < reach2
        start[i + 1] = e
    share, density = _weigh(kernel, start, distance2[:e])
    return Neighbours(start, other[:e], away[:e], share, density)


@njit(**OPTIONS)
def _weigh(kernel: Kernel, start: Ints, distance2: Floats) -> tuple[Floats, Floats]:
    """Weights over squared distances, and their number densities."""
    weights, share = np.empty(len(distance2)), np.empty(len(distance2))
    for k in range(len(distance2)):
        weights[k] = weight(kernel, math.sqrt(distance2[k]))
        share[k] = weights[k] / distance2[k]
    density = np.zeros(len(start) - 1)
    for i in range(len(density)):
        for k in range(start[i], start[i + 1]):
            density[i] += weights[k]
    return share, density
