"""Second stage of the contact search: which listed pairs may touch before the next look.

Most listed pairs lie further apart than grains go in many steps. A look at all of them keeps the
pairs with a gap below some length; none of the others can touch before the two grains have gone
that far between them. So no contact is missed, and no digit depends on when a look is taken. Only
near pairs have a history, one after the other in memory.
"""

from __future__ import annotations

import math
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from sandmould.arrays import Places
from sandmould.compiled import njit
from sandmould.dem.chunks import chunk_of, farthest_chunk
from sandmould.dem.grains import Floats, Grains, Ints
from sandmould.dem.neighbours import Pairs
from sandmould.dem.vectors import (
    OPTIONS,
    dot,
    index,
    load,
    load_spin,
    no_spin,
    no_vector,
    plus,
    store,
    times,
)

GAP_FACTOR = 2.0
"""Near is what has a gap below this times the root of skin times way per step: a longer gap has
more pairs that do not touch, a shorter one asks for more looks. Estimated, not tuned."""


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
    """Near pairs; those of a chunk fill the front of the room that the chunk has."""

    first: Ints
    """(c + 1,) int64: where the room of each chunk begins."""
    stop: Places
    """(n,) uint32: where the pairs of a grain end; they begin where those of the grain before end,
    or, for the first grain of a chunk, where the room of the chunk begins."""
    other: Places
    """(p,) uint32: the second grain."""
    touching: NDArray[np.uint8]
    """(p,) uint8: whether the pair touched at the last step."""
    friction: Floats
    """(p, s) float64, N: as in ``Contacts``; zero where a pair does not touch."""
    rolling: Floats
    """(p, s) float64, N m: likewise."""
    first_slot: Ints
    """(c + 1,) int64: where the room of each chunk for slots begins."""
    slot_bound: Ints
    """(c, f) int64: the slots of a chunk for the chunk t later begin with slot_bound[c, t - 1] and
    end before slot_bound[c, t]."""
    slot: Places
    """(q,) uint32: slots of those pairs that cross to a later chunk, from its first slot on."""
    slot_grain: Places
    """(q,) uint32: the second grain, in the order of slots as the next two."""
    slot_force: Floats
    """(q, d) float64, N: what the pair puts on it."""
    slot_moment: Floats
    """(q, s) float64, N m."""
    left: Floats
    """(1,) float64, m: how far any grain can still go before a look is due."""
    gap: Floats
    """(1,) float64, m: largest gap of near pairs where a look is due in this step, or negative."""
    full: Ints
    """(1,) int64: whether a look found more near pairs than a chunk has room for."""


@njit(**OPTIONS)
def contacts_of(dim: Any, bound: Ints, near: NearPairs) -> Contacts:
    """Touching pairs of grains, ``bound`` being the first grains of the chunks."""
    stop, other, touching = near.stop, near.other, near.touching
    near_friction, near_rolling = near.friction, near.rolling
    contacts = 0
    for c in range(len(bound) - 1):
        if bound[c + 1] > bound[c]:
            for k in range(near.first[c], stop[bound[c + 1] - 1]):
                contacts += touching[k]
    first, second = np.empty(contacts, dtype=np.int64), np.empty(contacts, dtype=np.int64)
    friction = np.empty((contacts, len(no_spin(dim))))
    rolling = np.empty((contacts, len(no_spin(dim))))
    filled = 0
    for c in range(len(bound) - 1):
        k = near.first[c]
        for i in range(bound[c], bound[c + 1]):
            while k < stop[i]:
                if touching[k]:
                    first[filled], second[filled] = i, other[k]
                    store(load_spin(dim, near_friction, k), friction, filled)
                    store(load_spin(dim, near_rolling, k), rolling, filled)
                    filled += 1
                k += 1
    return Contacts(first, second, friction, rolling)


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
        if a > b:  # what acts on the other grain is opposite; the tangent of 2D turns round with it
            store(times(load_spin(dim, rolling, k), -1.0), rolling, k)
            if len(dim) == 3:
                store(times(load_spin(dim, friction, k), -1.0), friction, k)


@njit(**OPTIONS)
def _carry(dim: Any, contacts: Contacts, bound: Ints, near: NearPairs) -> None:
    """Give near pairs the history of the contacts among them."""
    other, stop, first, touching = near.other, near.stop, near.first, near.touching
    near_friction, near_rolling = near.friction, near.rolling
    owner, partner = contacts.first, contacts.second
    friction, rolling = contacts.friction, contacts.rolling
    for k in range(len(owner)):
        i, j = owner[k], partner[k]
        c = chunk_of(bound, i)
        begin = first[c] if i == bound[c] else stop[i - 1]
        for q in range(begin, stop[i]):
            if other[q] == j:
                touching[q] = 1
                store(load_spin(dim, friction, k), near_friction, q)
                store(load_spin(dim, rolling, k), near_rolling, q)
                break


@njit(**OPTIONS)
def _choose(
    dim: Any, bound: Ints, grains: Grains, pairs: Pairs, gap: float
) -> tuple[Ints, Ints, Places, Places]:
    """Near pairs among the listed ones.

    Given are those of each chunk and those of them that cross to a later one, (c,) int64; where
    those of each grain end, counted from the first of its chunk, (n,) uint32; their second grains.
    """
    position, kind, radius = grains.position, grains.kind, grains.radius_of
    start, listed = pairs.start, pairs.other
    counts = np.zeros(len(bound) - 1, dtype=np.int64)
    crossing = np.zeros(len(bound) - 1, dtype=np.int64)
    stop = np.empty(len(position), dtype=np.uint32)
    other = np.empty(len(listed), dtype=np.uint32)
    k = 0
    for c in range(len(counts)):
        first, cross, end = k, 0, bound[c + 1]
        for i in range(bound[c], end):
            x, reach = load(dim, position, i), radius[kind[i]] + gap
            for p in range(index(start[i]), index(start[i + 1])):
                j = listed[p]
                apart = plus(load(dim, position, j), -1.0, x)
                far = reach + radius[kind[j]]
                # Written at all events: a branch here is guessed wrong too often.
                other[index(k)] = j
                is_near = dot(apart, apart) < far * far
                k += is_near
                cross += is_near & (j >= end)
            stop[i] = k - first
        counts[c], crossing[c] = k - first, cross
    return counts, crossing, stop, other


@njit(**OPTIONS)
def _give_slots(dim: Any, c: int, bound: Ints, near: NearPairs) -> None:
    """Give near pairs that cross to later chunks their slots, in the order of those chunks."""
    other, ends, end = near.other, near.slot_bound[c], bound[c + 1]
    first, last = near.first[c], near.stop[end - 1]
    ends[:] = 0
    for k in range(first, last):
        if other[k] >= end:
            ends[chunk_of(bound, other[k]) - c] += 1
    ends[0] = near.first_slot[c]
    for t in range(1, len(ends)):
        ends[t] += ends[t - 1]
    free, crossing = ends.copy(), near.first_slot[c]
    for k in range(first, last):
        if other[k] >= end:
            later = chunk_of(bound, other[k]) - c - 1
            slot = free[later]
            free[later] += 1
            near.slot[crossing], near.slot_grain[slot] = slot, other[k]
            store(no_vector(dim), near.slot_force, slot)
            store(no_spin(dim), near.slot_moment, slot)
            crossing += 1


@njit(**OPTIONS)
def _lay_out(dim: Any, bound: Ints, chosen: Places, near: NearPairs) -> None:
    """Put chosen pairs into the room of each chunk, and give those that cross their slots."""
    k = 0
    for c in range(len(bound) - 1):
        first, last = bound[c], bound[c + 1]
        if last > first:
            room = near.first[c]
            for q in range(near.stop[last - 1]):
                near.other[room + q] = chosen[k + q]
            k += near.stop[last - 1]
            for i in range(first, last):
                near.stop[i] += room
            _give_slots(dim, c, bound, near)


def _room(counts: Ints, most: Ints) -> Ints:
    """Where the room of each chunk begins: for a few more than there are now, (c + 1,) int64."""
    return np.concatenate([[0], np.minimum(counts + counts // 32 + 16, most).cumsum()])


def new_near_pairs(
    dim: Any, bound: Ints, grains: Grains, pairs: Pairs, contacts: Contacts, gap_m: float
) -> NearPairs:
    """Choose near pairs among the listed ones, with history from contacts.

    Parameters
    ----------
    dim : tuple of d floats
    bound : (c + 1,) int64
        First grains of the chunks.
    grains : Grains
        Where the forces are found next.
    pairs : Pairs
    contacts : Contacts
        Those that are not near are forgotten: they touch no more.
    gap_m : float
        Not negative.
    """
    counts, crossing, stop, chosen = _choose(dim, bound, grains, pairs, gap_m)
    first = _room(counts, np.diff(pairs.start[bound]))
    first_slot = _room(crossing, np.diff(first))
    room, slots, spins = first[-1], first_slot[-1], grains.spin.shape[1]
    near = NearPairs(
        first,
        stop,
        np.empty(room, dtype=np.uint32),
        np.zeros(room, dtype=np.uint8),
        np.zeros((room, spins)),
        np.zeros((room, spins)),
        first_slot,
        np.zeros((len(counts), farthest_chunk(bound, pairs) + 1), dtype=np.int64),
        np.empty(slots, dtype=np.uint32),
        np.empty(slots, dtype=np.uint32),
        np.empty((slots, len(dim))),
        np.empty((slots, spins)),
        np.full(1, 0.5 * gap_m),
        np.full(1, -1.0),
        np.zeros(1, dtype=np.int64),
    )
    _lay_out(dim, bound, chosen, near)
    _carry(dim, contacts, bound, near)
    return near


@njit(**OPTIONS)
def near_gap(skin: float, way: float) -> float:
    """Largest gap of near pairs, m, where grains go a way in a step and pairs have a skin."""
    return min(GAP_FACTOR * math.sqrt(skin * way), skin)


@njit(**OPTIONS)
def watch(near: NearPairs, way: float, skin: float) -> None:
    """Say whether a look is due after all grains have moved.

    Parameters
    ----------
    near : NearPairs
    way : float, m
        Longest way of a grain in this step.
    skin : float, m
        Gap of listed pairs.
    """
    near.left[0] -= way
    near.gap[0] = -1.0
    if near.left[0] < 0.0:
        near.gap[0] = near_gap(skin, way)
        near.left[0] = 0.5 * near.gap[0]


@njit(**OPTIONS)
def look(
    dim: Any,
    c: int,
    bound: Ints,
    grains: Grains,
    pairs: Pairs,
    near: NearPairs,
) -> None:
    """Choose the near pairs of a chunk anew among the listed ones, and keep their history.

    Where the chunk has too little room, its contacts alone are left and ``near.full`` is set.

    Parameters
    ----------
    dim : tuple of d floats
    c : int
        The chunk.
    bound : (c + 1,) int64
        First grains of the chunks.
    grains : Grains
    pairs : Pairs
    near : NearPairs
        Of this chunk written to.
    """
    # Names of their own: taking an array out of a tuple inside the loop counts references.
    near_other, touching, stop = near.other, near.touching, near.stop
    near_friction, near_rolling = near.friction, near.rolling
    start, listed = pairs.start, pairs.other
    position, kind, radius, gap = grains.position, grains.kind, grains.radius_of, near.gap[0]
    begin, end = bound[c], bound[c + 1]
    first, room = near.first[c], near.first[c + 1]
    last = stop[end - 1] if end > begin else first
    touched = 0
    for k in range(first, last):
        touched += touching[k]
    owner, other = np.empty(touched, dtype=np.int64), np.empty(touched, dtype=np.int64)
    friction = np.empty((touched, len(no_spin(dim))))
    rolling = np.empty((touched, len(no_spin(dim))))
    k, q = first, 0
    for i in range(begin, end):
        while k < stop[i]:
            if touching[k]:
                owner[q], other[q] = i, near_other[k]
                store(load_spin(dim, near_friction, k), friction, q)
                store(load_spin(dim, near_rolling, k), rolling, q)
                q += 1
            k += 1
    crossing, slots = 0, near.first_slot[c + 1] - near.first_slot[c]
    # Both lists are in the order of the listed pairs, so history is merged in as they pass.
    k, q, full = first, 0, False
    for i in range(begin, end):
        x, reach = load(dim, position, i), radius[kind[i]] + gap
        for p in range(index(start[i]), index(start[i + 1])):
            j = listed[p]
            apart = plus(load(dim, position, j), -1.0, x)
            far = reach + radius[kind[j]]
            held = q < touched and owner[q] == i and other[q] == j
            if dot(apart, apart) < far * far:
                crossing += j >= end
                full = k == room or crossing > slots
                if full:
                    break
                near_other[k] = j
                touching[k] = held
                store(load_spin(dim, friction, q) if held else no_spin(dim), near_friction, k)
                store(load_spin(dim, rolling, q) if held else no_spin(dim), near_rolling, k)
                k += 1
            if held:
                q += 1
        if full:
            break
        stop[i] = k
    if full:
        near.full[0] = 1
        q = 0
        for i in range(begin, end):
            while q < touched and owner[q] == i:
                near_other[first + q], touching[first + q] = other[q], 1
                store(load_spin(dim, friction, q), near_friction, first + q)
                store(load_spin(dim, rolling, q), near_rolling, first + q)
                q += 1
            stop[i] = first + q
    elif end > begin:
        _give_slots(dim, c, bound, near)
