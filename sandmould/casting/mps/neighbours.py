"""Candidates for neighbours, kept while particles move less than half a skin."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numba import njit
from numpy.typing import NDArray
from scipy.spatial import cKDTree

from sandmould.casting.mps.particles import DUMMY, Floats, Kinds
from sandmould.casting.mps.weight import INLINED, OPTIONS, Kernel

SKIN = 0.35
"""Over the particle size. Wider lists last longer, and each pass over them costs more."""


class Neighbours(NamedTuple):
    """Particles that may come within the kernel of each other, both ways round."""

    start: NDArray[np.int64]
    """(n + 1,) int64: candidates of particle i are start[i] to start[i + 1]."""
    other: NDArray[np.int32]
    """(p,) int32."""
    listed_m: Floats
    """(n, 3) float64, m: positions that the list was made at."""


@njit(**INLINED)
def apart(
    kernel: Kernel, position: Floats, i: int, j: int
) -> tuple[float, float, float, float]:
    """Vector from particle i to the nearest image of particle j, and its length squared."""
    dx = position[j, 0] - position[i, 0]
    dy = position[j, 1] - position[i, 1]
    dz = position[j, 2] - position[i, 2]
    period = kernel.period_m
    if period[0] > 0.0:
        dx -= period[0] * np.rint(dx / period[0])
    if period[1] > 0.0:
        dy -= period[1] * np.rint(dy / period[1])
    if period[2] > 0.0:
        dz -= period[2] * np.rint(dz / period[2])
    return dx, dy, dz, dx * dx + dy * dy + dz * dz


@njit(**OPTIONS)
def _both_ways(
    n: int, pair: NDArray[np.int64], kind: Kinds
) -> tuple[NDArray[np.int64], NDArray[np.int32]]:
    """Rows of candidates from pairs; dummies need none of each other."""
    start = np.zeros(n + 1, dtype=np.int64)
    for k in range(len(pair)):
        i, j = pair[k, 0], pair[k, 1]
        if kind[i] != DUMMY or kind[j] != DUMMY:
            start[i + 1] += 1
            start[j + 1] += 1
    for i in range(n):
        start[i + 1] += start[i]
    place = start[:-1].copy()
    other = np.empty(start[n], dtype=np.int32)
    for k in range(len(pair)):
        i, j = pair[k, 0], pair[k, 1]
        if kind[i] != DUMMY or kind[j] != DUMMY:
            other[place[i]] = j
            other[place[j]] = i
            place[i] += 1
            place[j] += 1
    return start, other


def find_neighbours(kernel: Kernel, position_m: Floats, kind: Kinds) -> Neighbours:
    """List candidates.

    Parameters
    ----------
    kernel : Kernel
    position_m : (n, 3) float64, m
        Finite.
    kind : (n,) int8
    """
    period = np.asarray(kernel.period_m)
    wrapped = np.where(period > 0.0, np.mod(position_m, np.where(period > 0.0, period, 1.0)), 0.0)
    # A tree wants points from 0 on in a periodic axis; mod may round up to the period itself.
    wrapped = np.where(period > 0.0, np.where(wrapped >= period, 0.0, wrapped), position_m)
    tree = cKDTree(wrapped, boxsize=period if period.any() else None, balanced_tree=False)
    reach_m = kernel.reach_m + SKIN * kernel.spacing_m
    pair = tree.query_pairs(reach_m, output_type="ndarray").astype(np.int64, copy=False)
    start, other = _both_ways(len(position_m), pair, kind)
    return Neighbours(start, other, position_m.copy())


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
