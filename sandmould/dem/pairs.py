"""One step of the grains of a chunk: forces between grains, in lanes, and the way they take."""

from __future__ import annotations

import math
from typing import Any

from sandmould.compiled import njit
from sandmould.dem.contact_law import Law, PairCoefficients, contact
from sandmould.dem.grains import Floats, Grains
from sandmould.dem.lanes import (
    any_of,
    beside,
    but,
    columns_at,
    every,
    fused,
    kinds_at,
    largest_of,
    places_at,
    put_columns,
    put_rows,
    rows_at,
)
from sandmould.dem.motion import Damping, kicked
from sandmould.dem.near_pairs import NearPairs
from sandmould.dem.vectors import OPTIONS, dot, index, kept_where, no_spin, plus, times

_NUMBER, _SIZES = (0.0,), (0.0, 0.0, 0.0)
"""As long as the rows that are read."""


@njit(**OPTIONS)
def pass_pairs(
    dim: Any,
    lanes: Any,
    c: int,
    grains: Grains,
    ahead: Floats,
    coefficients: Floats,
    near: NearPairs,
    law: Law,
    damping: Damping,
    body: Any,
    dt: float,
    moves: bool,
) -> float:
    """Add the forces between grains to those of a chunk, or let its grains move on at once.

    Grains that move on read nothing that others write: what they become goes to arrays of its own.

    Gives the largest squared speed of grains that move on, m2/s2; not a number as soon as one speed
    is none.

    Parameters
    ----------
    dim : tuple
        ``PLANE`` or ``SPACE``.
    c : int
        The chunk.
    grains : Grains
        Forces and moments are those of the surfaces. Grains that move on have their next velocity
        and spin in their place.
    ahead : (n, d) float64, m
        The next positions of grains that move on.
    coefficients : (k, k, 3) float64
        Of two kinds, for this law: see ``pair_up``.
    body : tuple of d floats, m/s2
        See ``kick``.
    dt : float, s
    moves : bool
        Whether the grains move on.
    """
    # Names of their own: taking an array out of a tuple inside the loop counts references.
    position, velocity, spin = grains.position, grains.velocity, grains.spin
    kind, radius, force, moment = grains.kind, grains.radius_of, grains.force, grains.moment
    mass, inertia = grains.mass_of, grains.inertia_of
    grain, other, held, history = near.grain, near.other, near.held, near.history
    first_row, last_row, kinds = near.first_row, near.last_row, len(radius)
    width, like_spin = len(lanes), no_spin(dim)
    part = len(like_spin) * width
    fastest2 = sound = every(lanes, 0.0)
    for s in range(near.first_slice[c], near.first_slice[c + 1]):
        mine = places_at(lanes, grain, s * width)
        x, v = rows_at(dim, position, mine), rows_at(dim, velocity, mine)
        w = rows_at(like_spin, spin, mine)
        force_i, moment_i = rows_at(dim, force, mine), rows_at(like_spin, moment, mine)
        kind_i = kinds_at(kind, mine)
        (r,) = rows_at(_NUMBER, radius, kind_i)
        for row in range(index(first_row[s]), index(last_row[s])):
            theirs = places_at(lanes, other, row * index(width))
            apart = plus(rows_at(dim, position, theirs), -1.0, x)
            kind_j = kinds_at(kind, theirs)
            (r_j,) = rows_at(_NUMBER, radius, kind_j)
            distance2, reach = dot(apart, apart), r + r_j
            touch = but(distance2 < reach * reach, mine, theirs)
            at = row * index(2 * part)
            if any_of(touch):
                distance = math.sqrt(distance2)
                overlap, closeness = reach - distance, 1.0 / distance
                sizes = rows_at(_SIZES, coefficients, beside(kind_i, kinds, kind_j))
                press, turn, _, slide, roll, _ = contact(
                    times(apart, closeness),
                    overlap,
                    plus(rows_at(dim, velocity, theirs), -1.0, v),
                    w,
                    rows_at(like_spin, spin, theirs),
                    fused(-0.5, overlap, r),
                    fused(-0.5, overlap, r_j),
                    law.lead_s * closeness,
                    PairCoefficients(sizes[0], sizes[1], sizes[2]),
                    law,
                    dt,
                    columns_at(w, history, at),
                    columns_at(w, history, at + index(part)),
                )
                held[row] = 1
                put_columns(kept_where(slide, touch), history, at)
                put_columns(kept_where(roll, touch), history, at + index(part))
                force_i = plus(force_i, 1.0, kept_where(press, touch))
                moment_i = plus(moment_i, 1.0, kept_where(turn, touch))
            elif held[row]:
                held[row] = 0
                put_columns(kept_where(w, touch), history, at)
                put_columns(kept_where(w, touch), history, at + index(part))
        if moves:
            (m,), (inert,) = rows_at(_NUMBER, mass, kind_i), rows_at(_NUMBER, inertia, kind_i)
            v, w = kicked(v, w, force_i, moment_i, m, inert, dt, body, damping)
            put_rows(v, force, mine)
            put_rows(w, moment, mine)
            put_rows(plus(x, dt, v), ahead, mine)
            speed2 = dot(v, v)
            fastest2, sound = max(fastest2, speed2), sound + speed2
        else:
            put_rows(force_i, force, mine)
            put_rows(moment_i, moment, mine)
    return largest_of(fastest2) if largest_of(sound) < math.inf else math.nan
