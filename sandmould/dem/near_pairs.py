"""Second stage of the contact search: which listed pairs may touch before the next look.

Most listed pairs lie further apart than grains go in many steps. A look at all of them keeps the
pairs with a gap below some length; none of the others can touch before the two grains have gone
that far between them. So no contact is missed, and no digit depends on when a look is taken. Only
near pairs have a history.

Near pairs lie in slices of W grains, one a lane. A slice has as many rows as its grain with most
near pairs, and a row has one pair of each grain, in the order of the listed ones. A pair stands
with both of its grains, each with a history of its own: opposite ones, digit by digit. Within a
window grains with about as many pairs share a slice, so few lanes are empty. No digit depends on W.
"""

from __future__ import annotations

import math
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from sandmould.arrays import Places
from sandmould.compiled import njit
from sandmould.dem.grains import Floats, Grains, Ints
from sandmould.dem.neighbours import Pairs
from sandmould.dem.vectors import (
    OPTIONS,
    dot,
    index,
    load,
    load_spin,
    no_spin,
    of_other,
    plus,
    store,
    times,
)

GAP_FACTOR = 2.0
"""Near is what has a gap below this times the root of skin times way per step: a longer gap has
more pairs that do not touch, a shorter one asks for more looks. Estimated, not tuned."""
WINDOW = 128
"""Grains among which those of a slice are chosen."""
_MOST = 64
"""Near pairs from which on a grain stands in front of its window."""


class Contacts(NamedTuple):
    """Touching pairs and their history, in the order of the listed pairs."""

    first: Ints
    """(c,) int64: the grain stored earlier."""
    second: Ints
    """(c,) int64."""
    friction: Floats
    """(c, s) float64, N: friction on the first grain, as a tangent."""
    rolling: Floats
    """(c, s) float64, N m: rolling moment on the first grain."""

    @classmethod
    def none(cls, dimension: int) -> Contacts:
        """No contact yet."""
        history, none = np.zeros((0, 1 if dimension == 2 else 3)), np.zeros(0, dtype=np.int64)
        return cls(none, none.copy(), history, history.copy())


class NearPairs(NamedTuple):
    """Near pairs of both grains; the rows of a chunk fill the front of the room that it has."""

    first_slice: Ints
    """(c + 1,) int64: first slice of each chunk."""
    grain: Places
    """(slices, W) uint32: the grain of each lane; behind the last of a chunk it is repeated, with
    all its pairs."""
    first_row: Ints
    """(slices,) int64: where the rows of each slice begin."""
    last_row: Ints
    """(slices,) int64: and end."""
    first: Ints
    """(c + 1,) int64: where the room of each chunk begins, in rows."""
    other: Places
    """(rows, W) uint32: the other grain of the pair; the grain itself where a lane is empty."""
    held: NDArray[np.uint8]
    """(rows,) uint8: whether a pair of the row touched at the last step."""
    history: Floats
    """(rows, 2 s, W) float64, N and N m: friction and rolling moment on the grain of the lane, as
    in ``Contacts``; zero where the pair does not touch."""
    left: Floats
    """(1,) float64, m: how far any grain can still go before a look is due."""
    gap: Floats
    """(1,) float64, m: largest gap of near pairs where a look is due in this step, or negative."""
    full: Ints
    """(1,) int64: whether a look found more near pairs than a chunk has room for."""


@njit(**OPTIONS)
def lanes_of(bound: Ints, near: NearPairs) -> Ints:
    """Where each grain stands: slice times W plus lane, (n,) int64."""
    width, place = near.grain.shape[1], np.empty(bound[-1], dtype=np.int64)
    for c in range(len(bound) - 1):
        for k in range(bound[c + 1] - bound[c]):
            s = near.first_slice[c] + k // width
            place[near.grain[s, k % width]] = s * width + k % width
    return place


@njit(**OPTIONS)
def contacts_of(dim: Any, bound: Ints, grains: Grains, near: NearPairs) -> Contacts:
    """Pairs that touch or have a history, ``bound`` being the first grains of the chunks."""
    width, spins = near.grain.shape[1], len(no_spin(dim))
    place = lanes_of(bound, near)
    most = 0
    for s in range(len(near.first_row)):
        most += near.last_row[s] - near.first_row[s]
    most = (most * width + 1) // 2
    first, second = np.empty(most, dtype=np.int64), np.empty(most, dtype=np.int64)
    friction, rolling = np.empty((most, spins)), np.empty((most, spins))
    position, kind, radius = grains.position, grains.kind, grains.radius_of
    filled = 0
    for i in range(len(place)):
        s, lane = place[i] // width, place[i] % width
        x, r = load(dim, position, i), radius[kind[i]]
        for row in range(near.first_row[s], near.last_row[s]):
            j = np.int64(near.other[row, lane])
            if j <= i:
                continue
            apart = plus(load(dim, position, j), -1.0, x)
            reach = r + radius[kind[j]]
            counts = dot(apart, apart) < reach * reach
            for k in range(2 * spins):
                counts = counts or near.history[row, k, lane] != 0.0
            if counts:
                first[filled], second[filled] = i, j
                for k in range(spins):
                    friction[filled, k] = near.history[row, k, lane]
                    rolling[filled, k] = near.history[row, spins + k, lane]
                filled += 1
    return Contacts(
        first[:filled].copy(),
        second[:filled].copy(),
        friction[:filled].copy(),
        rolling[:filled].copy(),
    )


@njit(**OPTIONS)
def move_contacts(dim: Any, contacts: Contacts, order: Ints) -> None:
    """Tell contacts that their grains are stored in another order, (n,) int64."""
    place = np.empty(len(order), dtype=np.uint32)
    for i in range(len(order)):
        place[order[i]] = i
    first, second = contacts.first, contacts.second
    friction, rolling = contacts.friction, contacts.rolling
    for k in range(len(first)):
        a, b = place[first[k]], place[second[k]]
        first[k], second[k] = min(a, b), max(a, b)
        if a > b:
            store(of_other(dim, load_spin(dim, friction, k)), friction, k)
            store(times(load_spin(dim, rolling, k), -1.0), rolling, k)


@njit(**OPTIONS)
def _carry(dim: Any, contacts: Contacts, bound: Ints, near: NearPairs) -> None:
    """Give near pairs the history of the contacts among them, both grains their own."""
    width, spins = near.grain.shape[1], len(no_spin(dim))
    place = lanes_of(bound, near)
    for c in range(len(contacts.first)):
        friction, rolling = (
            load_spin(dim, contacts.friction, c),
            load_spin(dim, contacts.rolling, c),
        )
        opposite = of_other(dim, friction), times(rolling, -1.0)
        ends = contacts.first[c], contacts.second[c]
        for i, j, (slides, rolls) in (
            (ends[0], ends[1], (friction, rolling)),
            (ends[1], ends[0], opposite),
        ):
            s, lane = place[i] // width, place[i] % width
            for row in range(near.first_row[s], near.last_row[s]):
                if near.other[row, lane] == j:
                    near.held[row] = 1
                    for k in range(spins):
                        near.history[row, k, lane] = slides[k]
                        near.history[row, spins + k, lane] = rolls[k]
                    break
    for s in range(len(near.grain)):
        for lane in range(1, width):
            # A lane behind the last repeats its grain, and what it finds is kept.
            if near.grain[s, lane] == near.grain[s, lane - 1]:
                for row in range(near.first_row[s], near.last_row[s]):
                    for k in range(2 * spins):
                        near.history[row, k, lane] = near.history[row, k, lane - 1]


@njit(**OPTIONS)
def _choose(
    dim: Any,
    c: int,
    bound: Ints,
    grains: Grains,
    pairs: Pairs,
    near: NearPairs,
    place: Ints,
    kept: Ints,
) -> tuple[Ints, Ints, Places, Ints]:
    """Near pairs of a chunk among the listed ones."""
    # Where each grain's end and how many touch, (n,) int64; the other grains; old rows or -1.
    # Names of their own: taking an array out of a tuple inside the loop counts references.
    start, listed, old_other, width = pairs.start, pairs.other, near.other, near.grain.shape[1]
    position, kind, radius, gap = grains.position, grains.kind, grains.radius_of, near.gap[0]
    begin, end, first = bound[c], bound[c + 1], index(near.first[c])
    stop, touching = np.empty(end - begin, dtype=np.int64), np.zeros(end - begin, dtype=np.int64)
    other = np.empty(start[end] - start[begin] + 1, dtype=np.uint32)
    source = np.empty(len(other), dtype=np.int64)
    k = 0
    for i in range(begin, end):
        x, r, touched = load(dim, position, i), radius[kind[i]], 0
        s, lane = place[i - begin] // width, index(place[i - begin] % width)
        row, last = index(near.first_row[s]), index(near.last_row[s])
        for p in range(index(start[i]), index(start[i + 1])):
            j = listed[p]
            apart = plus(load(dim, position, j), -1.0, x)
            distance2, reach = dot(apart, apart), r + radius[kind[j]]
            # Written at all events: a branch here is guessed wrong too often.
            other[index(k)], source[index(k)] = j, -1
            # Rows and listed pairs are in the same order.
            if row < last and old_other[row, lane] == j:
                source[index(k)] = kept[row - first]
                row += index(1)
            touched += distance2 < reach * reach
            k += distance2 < (reach + gap) * (reach + gap)
        stop[i - begin], touching[i - begin] = k, touched
    return stop, touching, other, source


@njit(**OPTIONS)
def _arrange(stop: Ints, touching: Ints, width: int) -> tuple[Ints, Ints]:
    """Grains of a chunk in the order of lanes, touching ones first; and rows of each slice."""
    n = len(stop)
    order, rows = (
        np.empty(-(-n // width) * width, dtype=np.int64),
        np.zeros(-(-n // width), np.int64),
    )
    ahead = np.empty(2 * _MOST + 3, dtype=np.int64)
    bucket = np.empty(n, dtype=np.int64)
    for first in range(0, n, WINDOW):
        last = min(first + WINDOW, n)
        ahead[:] = 0
        for k in range(first, last):
            bucket[k] = _MOST - min(stop[k] - (stop[k - 1] if k else 0), _MOST)
            bucket[k] += 0 if touching[k] else _MOST + 1
            ahead[bucket[k] + 1] += 1
        ahead[0] = first
        for k in range(2 * _MOST + 2):
            ahead[k + 1] += ahead[k]
        for k in range(first, last):
            count = stop[k] - (stop[k - 1] if k else 0)
            slot = ahead[bucket[k]]
            ahead[bucket[k]] += 1
            order[slot] = k
            rows[slot // width] = max(rows[slot // width], count)
    for slot in range(n, len(order)):
        order[slot] = order[n - 1]
    return order, rows


@njit(**OPTIONS)
def _rows_needed(dim: Any, bound: Ints, grains: Grains, pairs: Pairs, near: NearPairs) -> Ints:
    """Rows of the near pairs of each chunk, (c,) int64; there is none yet."""
    needed, none = np.zeros(len(bound) - 1, dtype=np.int64), np.zeros(0, dtype=np.int64)
    for c in range(len(needed)):
        place = np.zeros(bound[c + 1] - bound[c], dtype=np.int64)
        stop, touching, _, _ = _choose(dim, c, bound, grains, pairs, near, place, none)
        needed[c] = _arrange(stop, touching, near.grain.shape[1])[1].sum()
    return needed


@njit(**OPTIONS)
def look(dim: Any, c: int, bound: Ints, grains: Grains, pairs: Pairs, near: NearPairs) -> None:
    """Choose the near pairs of a chunk anew among the listed ones, and keep their history.

    Where the chunk has too little room, they stay as they are and ``near.full`` is set.

    Parameters
    ----------
    c : int
        The chunk.
    bound : (c + 1,) int64
        First grains of the chunks.
    near : NearPairs
        Of this chunk written to.
    """
    grain, other, held, history = near.grain, near.other, near.held, near.history
    first_row, last_row, width = near.first_row, near.last_row, near.grain.shape[1]
    first_slice, last_slice = near.first_slice[c], near.first_slice[c + 1]
    begin, first, parts = bound[c], near.first[c], history.shape[1]
    if last_slice == first_slice:
        return
    kept = np.full(last_row[last_slice - 1] - first, -1)
    rows_kept = 0
    for row in range(len(kept)):
        if held[first + row]:
            kept[row] = rows_kept
            rows_kept += 1
    histories = np.empty((rows_kept, parts, width))
    for row in range(len(kept)):
        if kept[row] >= 0:
            for part in range(parts):
                for lane in range(width):
                    histories[kept[row], part, lane] = history[first + row, part, lane]
    place = np.empty(bound[c + 1] - begin, dtype=np.int64)
    for k in range(len(place)):
        slot = first_slice * width + k
        place[grain[slot // width, slot % width] - begin] = slot
    stop, touching, chosen, source = _choose(dim, c, bound, grains, pairs, near, place, kept)
    order, rows = _arrange(stop, touching, width)
    if rows.sum() > near.first[c + 1] - first:
        near.full[0] = 1
        return
    row = first
    for s in range(len(rows)):
        end = row + rows[s]
        first_row[first_slice + s], last_row[first_slice + s] = row, end
        for q in range(row, end):
            held[q] = 0
            for part in range(parts):
                for lane in range(width):
                    history[q, part, lane] = 0.0
        for lane in range(width):
            k = order[s * width + lane]
            grain[first_slice + s, lane] = begin + k
            q, old = row, place[k] % width
            for p in range(stop[k - 1] if k else 0, stop[k]):
                other[q, lane] = chosen[p]
                if source[p] >= 0:
                    held[q] = 1
                    for part in range(parts):
                        history[q, part, lane] = histories[source[p], part, old]
                q += 1
            for empty in range(q, end):
                other[empty, lane] = begin + k
        row = end


def new_near_pairs(
    dim: Any,
    width: int,
    bound: Ints,
    grains: Grains,
    pairs: Pairs,
    contacts: Contacts,
    gap_m: float,
) -> NearPairs:
    """Choose near pairs among the listed ones, with history from contacts.

    Parameters
    ----------
    bound : (c + 1,) int64
        First grains of the chunks.
    grains : Grains
        Where the forces are found next.
    contacts : Contacts
        Those that are not near are forgotten: they touch no more.
    """
    counts = np.diff(bound)
    first_slice = np.concatenate([[0], (-(-counts // width)).cumsum()])
    grain = np.concatenate(
        [
            np.minimum(np.arange(begin, begin + slices * width), end - 1)
            for begin, end, slices in zip(bound, bound[1:], np.diff(first_slice), strict=False)
        ]
    ).reshape(-1, width)
    near = NearPairs(
        first_slice,
        grain.astype(np.uint32),
        np.zeros(len(grain), dtype=np.int64),
        np.zeros(len(grain), dtype=np.int64),
        np.zeros(len(bound), dtype=np.int64),
        np.zeros((0, width), dtype=np.uint32),
        np.zeros(0, dtype=np.uint8),
        np.zeros((0, 2 * grains.spin.shape[1], width)),
        np.full(1, 0.5 * gap_m),
        np.full(1, gap_m),
        np.zeros(1, dtype=np.int64),
    )
    needed = _rows_needed(dim, bound, grains, pairs, near)
    first = np.concatenate([[0], (needed + needed // 32 + 16).cumsum()])
    near.first_row[:] = near.last_row[:] = np.repeat(first[:-1], np.diff(first_slice))
    near = near._replace(
        first=first,
        other=np.empty((first[-1], width), dtype=np.uint32),
        held=np.zeros(first[-1], dtype=np.uint8),
        history=np.empty((first[-1], *near.history.shape[1:])),
    )
    for c in range(len(counts)):
        look(dim, c, bound, grains, pairs, near)
    near.gap[0] = -1.0
    _carry(dim, contacts, bound, near)
    return near


@njit(**OPTIONS)
def near_gap(skin: float, way: float) -> float:
    """Largest gap of near pairs, m, where grains go a way in a step and pairs have a skin."""
    return min(GAP_FACTOR * math.sqrt(skin * way), skin)


@njit(**OPTIONS)
def watch(near: NearPairs, way: float, skin: float) -> None:
    """Say whether a look is due after all grains have moved.

    ``way``, m: longest way of a grain in this step. ``skin``, m: gap of listed pairs.
    """
    near.left[0] -= way
    near.gap[0] = -1.0
    if near.left[0] < 0.0:
        near.gap[0] = near_gap(skin, way)
        near.left[0] = 0.5 * near.gap[0]
