"""Forces between grains, chunk by chunk of grains stored one after the other.

A chunk writes to its own grains alone. What it puts on grains of later chunks goes to slots of its
own and is added by their chunk afterwards, in a fixed order: results do not depend on how threads
are scheduled, nor on their number.
"""

from __future__ import annotations

import math
from typing import Any, NamedTuple

import numpy as np

from sandmould.compiled import njit
from sandmould.dem.contact_law import Law, contact
from sandmould.dem.grains import Floats, Grains, Ints
from sandmould.dem.kinds import Kinds, pair_coefficients_of
from sandmould.dem.near_pairs import NearPairs
from sandmould.dem.neighbours import Pairs
from sandmould.dem.vectors import (
    OPTIONS,
    add_to,
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

CHUNK = 4096
"""Grains of a chunk."""


class Chunks(NamedTuple):
    """Parts of the grains that are computed side by side, and what crosses between them."""

    bound: Ints
    """(c + 1,) int64: first grain of each chunk."""
    first_slot: Ints
    """(c + 1,) int64: first slot of each chunk."""
    grain: Ints
    """(q,) int64: the grain of a later chunk that a slot belongs to."""
    incoming: Ints
    """(q,) int64: slots in the order of the chunks of their grains."""
    first_incoming: Ints
    """(c + 1,) int64: where the slots for each chunk begin in that order."""
    force: Floats
    """(q, d) float64, N."""
    moment: Floats
    """(q, s) float64, N m."""


def chunk_bounds(grains: int) -> Ints:
    """Split grains into chunks of about ``CHUNK``; how many depends on the scene alone.

    A chunk fits into a core's own cache, and few of its pairs cross to another. Their number is
    even, so that two threads share them evenly.
    """
    chunks = max(1, 2 * round(grains / (2 * CHUNK)))
    return np.linspace(0, grains, chunks + 1).astype(np.int64)


@njit(**OPTIONS)
def _crossing(bound: Ints, pairs: Pairs) -> tuple[Ints, Ints]:
    first_slot = np.zeros(len(bound), dtype=np.int64)
    grain = np.empty(len(pairs.other), dtype=np.int64)
    slots = 0
    for c in range(len(bound) - 1):
        end = bound[c + 1]
        for k in range(pairs.start[bound[c]], pairs.start[end]):
            if pairs.other[k] >= end:
                grain[slots] = pairs.other[k]
                slots += 1
        first_slot[c + 1] = slots
    return first_slot, grain[:slots].copy()


def split(grains: Grains, pairs: Pairs) -> Chunks:
    """Make the chunks of a list of pairs."""
    n, d = grains.position.shape
    bound = chunk_bounds(n)
    first_slot, grain = _crossing(bound, pairs)
    chunk = np.searchsorted(bound, grain, side="right") - 1
    incoming = np.argsort(chunk, kind="stable")
    first_incoming = np.searchsorted(chunk[incoming], np.arange(len(bound)))
    force = np.zeros((len(grain), d))
    moment = np.zeros((len(grain), grains.spin.shape[1]))
    return Chunks(bound, first_slot, grain, incoming, first_incoming, force, moment)


@njit(**OPTIONS)
def pair_forces(
    dim: Any,
    c: int,
    chunks: Chunks,
    grains: Grains,
    kinds: Kinds,
    pairs: Pairs,
    near: NearPairs,
    law: Law,
    dt: float,
) -> None:
    """Add the forces of one chunk's pairs; its grains' forces must be zero before.

    Parameters
    ----------
    dim : tuple
        ``PLANE`` or ``SPACE``.
    c : int
        The chunk.
    chunks : Chunks
    grains : Grains
    kinds : Kinds
        Of the grains, for this law.
    pairs : Pairs
    near : NearPairs
        Of these.
    law : Law
    dt : float, s
    """
    # Names of their own: taking an array out of a tuple inside the loop counts references.
    position, velocity, spin = grains.position, grains.velocity, grains.spin
    radius, force, moment = grains.radius, grains.force, grains.moment
    kind, coefficients = kinds.of_grain, kinds.coefficients
    stop, other, touching, slots = near.stop, near.other, near.touching, near.slot
    friction, rolling = near.friction, near.rolling
    slot_force, slot_moment = chunks.force, chunks.moment
    begin, end = chunks.bound[c], index(chunks.bound[c + 1])
    crossing = chunks.first_slot[c]
    first = pairs.start[begin]
    for i in range(begin, chunks.bound[c + 1]):
        x, v, w = load(dim, position, i), load(dim, velocity, i), load_spin(dim, spin, i)
        r, kind_i = radius[i], index(kind[i])
        force_i, moment_i = no_vector(dim), no_spin(dim)
        for k in range(index(first), index(stop[i])):
            j = index(other[k])
            r_j = radius[j]
            apart = plus(load(dim, position, j), -1.0, x)
            distance2 = dot(apart, apart)
            reach = r + r_j
            if distance2 < reach * reach:
                distance = math.sqrt(distance2)
                overlap, closeness = reach - distance, 1.0 / distance
                press, turn_i, turn_j, slide, roll, _ = contact(
                    times(apart, closeness),
                    overlap,
                    plus(load(dim, velocity, j), -1.0, v),
                    w,
                    load_spin(dim, spin, j),
                    r - 0.5 * overlap,
                    r_j - 0.5 * overlap,
                    law.lead_s * closeness,
                    pair_coefficients_of(coefficients, kind_i, index(kind[j])),
                    law,
                    dt,
                    load_spin(dim, friction, k),
                    load_spin(dim, rolling, k),
                )
                touching[k] = 1
                store(slide, friction, k)
                store(roll, rolling, k)
                force_i = plus(force_i, 1.0, press)
                moment_i = plus(moment_i, 1.0, turn_i)
                if j < end:
                    add_to(press, -1.0, force, j)
                    add_to(turn_j, 1.0, moment, j)
                else:
                    store(times(press, -1.0), slot_force, slots[crossing])
                    store(turn_j, slot_moment, slots[crossing])
            elif touching[k]:
                touching[k] = 0
                store(no_spin(dim), friction, k)
                store(no_spin(dim), rolling, k)
                if j >= end:
                    store(no_vector(dim), slot_force, slots[crossing])
                    store(no_spin(dim), slot_moment, slots[crossing])
            if j >= end:
                crossing += 1
        first = stop[i]
        add_to(force_i, 1.0, force, i)
        add_to(moment_i, 1.0, moment, i)


@njit(**OPTIONS)
def gather_incoming(dim: Any, c: int, chunks: Chunks, grains: Grains) -> None:
    """Add what earlier chunks put on the grains of one chunk."""
    for q in range(chunks.first_incoming[c], chunks.first_incoming[c + 1]):
        slot = chunks.incoming[q]
        add_to(load(dim, chunks.force, slot), 1.0, grains.force, chunks.grain[slot])
        add_to(load_spin(dim, chunks.moment, slot), 1.0, grains.moment, chunks.grain[slot])
