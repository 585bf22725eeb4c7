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
    """Near pairs; each chunk fills the front of the places that its listed pairs would take."""

    stop: Ints
    """(n,) int64: where the pairs of a grain end; they begin where those of the grain before end,
    or, for the first grain of a chunk, at the place of its first listed pair."""
    other: NDArray[np.uint32]
    """(p,) uint32: the second grain."""
    touching: NDArray[np.uint8]
    """(p,) uint8: whether the pair touched at the last step."""
    friction: Floats
    """(p, s) float64, N: as in ``Contacts``; zero where a pair does not touch."""
    rolling: Floats
    """(p, s) float64, N m: likewise."""
    slot: Ints
    """(q,) int64: slots of those pairs that cross to a later chunk, from its first slot on."""
    left: Floats
    """(1,) float64, m: how far any grain can still go before a look is due."""
    gap: Floats
    """(1,) float64, m: largest gap of near pairs where a look is due in this step, or negative."""


@njit(**OPTIONS)
def contacts_of(dim: Any, bound: Ints, pairs: Pairs, near: NearPairs) -> Contacts:
    """Touching pairs of grains, ``bound`` being the first grains of the chunks."""
    stop, other, touching = near.stop, near.other, near.touching
    most = len(touching)  # flags behind the near pairs of a chunk are of no meaning
    first, second = np.empty(most, dtype=np.int64), np.empty(most, dtype=np.int64)
    friction = np.empty((most, len(no_spin(dim))))
    rolling = np.empty((most, len(no_spin(dim))))
    filled = 0
    for c in range(len(bound) - 1):
        k = pairs.start[bound[c]]
        for i in range(bound[c], bound[c + 1]):
            while k < stop[i]:
                if touching[k]:
                    first[filled], second[filled] = i, other[k]
                    store(load_spin(dim, near.friction, k), friction, filled)
                    store(load_spin(dim, near.rolling, k), rolling, filled)
                    filled += 1
                k += 1
    return Contacts(
        first[:filled].copy(),
        second[:filled].copy(),
        friction[:filled].copy(),
        rolling[:filled].copy(),
    )


@njit(**OPTIONS)
def moved_contacts(dim: Any, old: Contacts, place: Ints) -> Contacts:
    """Contacts of grains that are stored in new places; ``place`` gives them, (n,) int64."""
    new = Contacts(
        np.empty_like(old.first),
        np.empty_like(old.first),
        np.empty_like(old.friction),
        np.empty_like(old.rolling),
    )
    for k in range(len(old.first)):
        a, b = place[old.first[k]], place[old.second[k]]
        swapped = a > b
        # what acts on the other grain is opposite; so is the tangent of 2D
        turned_round = swapped and len(dim) == 3
        new.first[k], new.second[k] = min(a, b), max(a, b)
        store(
            times(load_spin(dim, old.friction, k), -1.0 if turned_round else 1.0), new.friction, k
        )
        store(times(load_spin(dim, old.rolling, k), -1.0 if swapped else 1.0), new.rolling, k)
    return new


@njit(**OPTIONS)
def _carry(dim: Any, contacts: Contacts, pairs: Pairs, near: NearPairs) -> None:
    """Give near pairs that are all the listed ones the history of the contacts among them."""
    for k in range(len(contacts.first)):
        i = contacts.first[k]
        for q in range(pairs.start[i], pairs.start[i + 1]):
            if pairs.other[q] == contacts.second[k]:
                near.touching[q] = 1
                store(load_spin(dim, contacts.friction, k), near.friction, q)
                store(load_spin(dim, contacts.rolling, k), near.rolling, q)
                break


def new_near_pairs(dim: Any, pairs: Pairs, slots: int, contacts: Contacts) -> NearPairs:
    """Near pairs before the first look: all that are listed, with history from contacts.

    Parameters
    ----------
    dim : tuple of d floats
    pairs : Pairs
        Newly listed.
    slots : int
        Pairs that cross between chunks.
    contacts : Contacts
        Those that are not listed are forgotten.
    """
    history = np.zeros((len(pairs.other), 1 if len(dim) == 2 else 3))
    near = NearPairs(
        pairs.start[1:].copy(),
        pairs.other.copy(),
        np.zeros(len(pairs.other), dtype=np.uint8),
        history,
        history.copy(),
        np.arange(slots),
        np.zeros(1),
        np.full(1, -1.0),
    )
    _carry(dim, contacts, pairs, near)
    return near


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
        near.gap[0] = min(GAP_FACTOR * math.sqrt(skin * way), skin)
        near.left[0] = 0.5 * near.gap[0]


@njit(**OPTIONS)
def look(
    dim: Any,
    c: int,
    bound: Ints,
    first_slot: Ints,
    grains: Grains,
    pairs: Pairs,
    near: NearPairs,
    slot_force: Floats,
    slot_moment: Floats,
) -> None:
    """Choose the near pairs of a chunk anew among the listed ones, and keep their history.

    Parameters
    ----------
    dim : tuple of d floats
    c : int
        The chunk.
    bound, first_slot, slot_force, slot_moment
        Of ``Chunks``; what the chunk's own slots hold is cleared.
    grains : Grains
    pairs : Pairs
    near : NearPairs
        Of this chunk written to.
    """
    position, radius, gap = grains.position, grains.radius, near.gap[0]
    begin, end = bound[c], bound[c + 1]
    first, last = pairs.start[begin], near.stop[end - 1] if end > begin else pairs.start[begin]
    touched = 0
    for k in range(first, last):
        touched += near.touching[k]
    owner, other = np.empty(touched, dtype=np.int64), np.empty(touched, dtype=np.int64)
    friction = np.empty((touched, len(no_spin(dim))))
    rolling = np.empty((touched, len(no_spin(dim))))
    k, q = first, 0
    for i in range(begin, end):
        while k < near.stop[i]:
            if near.touching[k]:
                owner[q], other[q] = i, near.other[k]
                store(load_spin(dim, near.friction, k), friction, q)
                store(load_spin(dim, near.rolling, k), rolling, q)
                q += 1
            k += 1
    slot, crossing = first_slot[c], first_slot[c]
    for s in range(first_slot[c], first_slot[c + 1]):
        store(no_vector(dim), slot_force, s)
        store(no_spin(dim), slot_moment, s)
    # Both lists are in the order of the listed pairs, so history is merged in as they pass.
    k, q = first, 0
    for i in range(begin, end):
        x, reach = load(dim, position, i), radius[i] + gap
        for p in range(index(pairs.start[i]), index(pairs.start[i + 1])):
            j = pairs.other[p]
            apart = plus(load(dim, position, j), -1.0, x)
            far = reach + radius[j]
            held = q < touched and owner[q] == i and other[q] == j
            if dot(apart, apart) < far * far:
                near.other[k] = j
                near.touching[k] = held
                store(load_spin(dim, friction, q) if held else no_spin(dim), near.friction, k)
                store(load_spin(dim, rolling, q) if held else no_spin(dim), near.rolling, k)
                k += 1
                if j >= end:
                    near.slot[crossing] = slot
                    crossing += 1
            if held:
                q += 1
            if j >= end:
                slot += 1
        near.stop[i] = k
