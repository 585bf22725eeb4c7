"""What the contacts of a grain with surfaces remember, told apart by their normals.

A grain that crosses a joint touches another facet with nearly the same normal: the friction goes
on. So the memory belongs to the grain and a direction, not to a facet.
"""

from __future__ import annotations

import math
from typing import Any, NamedTuple

import numpy as np

from sandmould.arrays import Floats, Ints
from sandmould.compiled import njit
from sandmould.dem.vectors import OPTIONS, dot, load, load_spin, no_spin, store

SAME_CONTACT = math.cos(math.radians(30.0))
"""A contact takes over the memory of one whose normal was nearer than this."""


class WallHistory(NamedTuple):
    """Memory of m grains; slot k of row i lies in row i slots + k of the last three."""

    used: Ints
    """(m,) int64: slots in use."""
    normal: Floats
    """(m slots, d) float64: normal from the grain to the surface."""
    friction: Floats
    """(m slots, 1 or 3) float64, N: friction on the grain as a tangent."""
    rolling: Floats
    """(m slots, 1 or 3) float64, N m: rolling moment on the grain."""


@njit(**OPTIONS)
def slots(dim: Any) -> int:
    """Contacts with surfaces that a grain can have: 4 in 2D, 6 in 3D."""
    return 2 * len(dim)


@njit(**OPTIONS)
def recall(dim: Any, normal: Floats, first: int, last: int, n: Any) -> int:
    """Find the slot among first ... last - 1 whose normal is nearest to n, or -1."""
    best, largest = -1, SAME_CONTACT
    for k in range(first, last):
        cosine = dot(n, load(dim, normal, k))
        if cosine > largest:
            best, largest = k, cosine
    return best


@njit(**OPTIONS)
def swap(
    dim: Any,
    normal: Floats,
    friction: Floats,
    rolling: Floats,
    a: int,
    b: int,
) -> None:
    """Exchange two slots."""
    n, t, m = load(dim, normal, a), load_spin(dim, friction, a), load_spin(dim, rolling, a)
    store(load(dim, normal, b), normal, a)
    store(load_spin(dim, friction, b), friction, a)
    store(load_spin(dim, rolling, b), rolling, a)
    store(n, normal, b)
    store(t, friction, b)
    store(m, rolling, b)


@njit(**OPTIONS)
def new_history(dim: Any, m: int) -> WallHistory:
    """Empty memory of m grains."""
    rows = m * slots(dim)
    return WallHistory(
        np.zeros(m, dtype=np.int64),
        np.zeros((rows, len(dim))),
        np.zeros((rows, len(no_spin(dim)))),
        np.zeros((rows, len(no_spin(dim)))),
    )


@njit(**OPTIONS)
def carry_history(dim: Any, old_ids: Ints, old: WallHistory, new_ids: Ints) -> WallHistory:
    """Memory in the order of new rows.

    Parameters
    ----------
    dim : tuple of d floats
    old_ids, new_ids : (m,) int64
        Which grain, by an identity that outlives sorting, each row stands for; not negative.
    old : WallHistory
        In the order of the old rows.
    """
    new = new_history(dim, len(new_ids))
    if len(old_ids) == 0:
        return new
    largest = 0
    for row in range(len(old_ids)):
        largest = max(largest, old_ids[row])
    row_of = np.full(largest + 1, -1, dtype=np.int64)
    for row in range(len(old_ids)):
        row_of[old_ids[row]] = row
    n = slots(dim)
    for row in range(len(new_ids)):
        old_row = row_of[new_ids[row]] if new_ids[row] < len(row_of) else -1
        if old_row >= 0:
            new.used[row] = old.used[old_row]
            for k in range(old.used[old_row]):
                a, b = old_row * n + k, row * n + k
                store(load(dim, old.normal, a), new.normal, b)
                store(load_spin(dim, old.friction, a), new.friction, b)
                store(load_spin(dim, old.rolling, a), new.rolling, b)
    return new
