"""What the contacts of a grain with surfaces remember, told apart by their normals.

A grain that crosses a joint touches another facet with nearly the same normal: the friction goes
on. So the memory belongs to the grain and a direction, not to a facet.
"""

from __future__ import annotations

import math
from typing import Any, NamedTuple, TypeAlias

import numpy as np

from sandmould.arrays import Floats, Ints, Places, WholeNumbers
from sandmould.compiled import njit
from sandmould.dem.vectors import OPTIONS, dot, load, load_spin, no_spin, store

Ids: TypeAlias = Ints | Places
SAME_CONTACT = math.cos(math.radians(30.0))
"""A contact takes over the memory of one whose normal was nearer than this."""


class WallHistory(NamedTuple):
    """Memory of m grains; slot k of row i lies in row first_slot[i] + k of the last three."""

    first_slot: WholeNumbers
    """(m + 1,) uint32: where the slots of each row begin."""
    used: WholeNumbers
    """(m,) uint8: slots in use."""
    normal: Floats
    """(s, d) float64: normal from the grain to the surface."""
    friction: Floats
    """(s, 1 or 3) float64, N: friction on the grain as a tangent."""
    rolling: Floats
    """(s, 1 or 3) float64, N m: rolling moment on the grain."""


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
def _empty(dim: Any, first_slot: Places) -> WallHistory:
    n = int(first_slot[-1])
    return WallHistory(
        first_slot,
        np.zeros(len(first_slot) - 1, dtype=np.uint8),
        np.zeros((n, len(dim))),
        np.zeros((n, len(no_spin(dim)))),
        np.zeros((n, len(no_spin(dim)))),
    )


@njit(**OPTIONS)
def new_history(dim: Any, m: int) -> WallHistory:
    """Empty memory of m grains, each with all slots."""
    return _empty(dim, (np.arange(m + 1) * slots(dim)).astype(np.uint32))


@njit(**OPTIONS)
def _room(dim: Any, parts: int, used: int) -> int:
    """Slots that a grain near some parts needs: a contact moves a used one behind the others."""
    if parts == 1:
        return max(1, used)
    return min(slots(dim), parts + max(parts, used))


@njit(**OPTIONS)
def carry_history(
    dim: Any, old_ids: Ids, old: WallHistory, new_ids: Ids, start: WholeNumbers
) -> WallHistory:
    """Memory in the order of new rows.

    Parameters
    ----------
    old_ids, new_ids : (m,) integers
        Which grain, by an identity that outlives sorting, each row stands for; not negative.
    old : WallHistory
        In the order of the old rows.
    start : (m + 1,) uint32
        Of the ``Candidates`` of the new rows.
    """
    largest = -1
    for row in range(len(old_ids)):
        largest = max(largest, old_ids[row])
    row_of = np.full(largest + 1, -1, dtype=np.int64)
    for row in range(len(old_ids)):
        row_of[old_ids[row]] = row
    first_slot = np.zeros(len(new_ids) + 1, dtype=np.uint32)
    for row in range(len(new_ids)):
        old_row = row_of[new_ids[row]] if new_ids[row] < len(row_of) else -1
        used = int(old.used[old_row]) if old_row >= 0 else 0
        room = _room(dim, int(start[row + 1]) - int(start[row]), used)
        first_slot[row + 1] = first_slot[row] + room
    new = _empty(dim, first_slot)
    for row in range(len(new_ids)):
        old_row = row_of[new_ids[row]] if new_ids[row] < len(row_of) else -1
        if old_row >= 0:
            new.used[row] = old.used[old_row]
            for k in range(old.used[old_row]):
                a, b = old.first_slot[old_row] + k, first_slot[row] + k
                store(load(dim, old.normal, a), new.normal, b)
                store(load_spin(dim, old.friction, a), new.friction, b)
                store(load_spin(dim, old.rolling, a), new.rolling, b)
    return new
