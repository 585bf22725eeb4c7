"""Forces between grains, chunk by chunk."""

from __future__ import annotations

import math
from typing import Any

from sandmould.compiled import njit
from sandmould.dem.contact_law import Law, contact
from sandmould.dem.grains import Floats, Grains, Ints
from sandmould.dem.kinds import pair_coefficients_of
from sandmould.dem.near_pairs import NearPairs
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


@njit(**OPTIONS)
def pair_forces(
    dim: Any,
    c: int,
    bound: Ints,
    grains: Grains,
    coefficients: Floats,
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
    bound : (c + 1,) int64
        First grains of the chunks.
    grains : Grains
    coefficients : (k, k, 3) float64
        Of two kinds, for this law: see ``pair_up``.
    near : NearPairs
    law : Law
    dt : float, s
    """
    # Names of their own: taking an array out of a tuple inside the loop counts references.
    position, velocity, spin = grains.position, grains.velocity, grains.spin
    kind, radius, force, moment = grains.kind, grains.radius_of, grains.force, grains.moment
    stop, other, touching, slots = near.stop, near.other, near.touching, near.slot
    friction, rolling = near.friction, near.rolling
    slot_force, slot_moment = near.slot_force, near.slot_moment
    begin, end = bound[c], index(bound[c + 1])
    crossing = near.first_slot[c]
    first = near.first[c]
    for i in range(begin, bound[c + 1]):
        x, v, w = load(dim, position, i), load(dim, velocity, i), load_spin(dim, spin, i)
        kind_i = index(kind[i])
        r = radius[kind_i]
        force_i, moment_i = no_vector(dim), no_spin(dim)
        for k in range(index(first), index(stop[i])):
            j = index(other[k])
            kind_j = index(kind[j])
            r_j = radius[kind_j]
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
                    pair_coefficients_of(coefficients, kind_i, kind_j),
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
def gather_incoming(dim: Any, c: int, near: NearPairs, grains: Grains) -> None:
    """Add what earlier chunks put on the grains of one chunk, the earliest first."""
    slot_bound, grain, force, moment = (
        near.slot_bound, near.slot_grain, grains.force, grains.moment
    )  # fmt: skip
    slot_force, slot_moment = near.slot_force, near.slot_moment
    for earlier in range(min(c, slot_bound.shape[1] - 1), 0, -1):
        begin, end = slot_bound[c - earlier, earlier - 1], slot_bound[c - earlier, earlier]
        for slot in range(begin, end):
            add_to(load(dim, slot_force, slot), 1.0, force, grain[slot])
            add_to(load_spin(dim, slot_moment, slot), 1.0, moment, grain[slot])
