"""Contacts of grains with surfaces, without bumps or double contacts at joints.

Of all parts within a grain the nearest is touched first. Each contact then covers those that do
not show in front of its tangent plane, which is all of a convex body, and those whose normals
hardly differ from its own. An edge that belongs to a nearer part too is no contact either. What is
left are the contacts of a concave corner.
"""

from __future__ import annotations

import math
from typing import Any

import numpy as np
from numpy.typing import NDArray

from sandmould.arrays import Flags, Floats
from sandmould.compiled import njit
from sandmould.dem.broad_phase import Candidates
from sandmould.dem.contact_law import Law, contact, pair_coefficients
from sandmould.dem.nearest_point import FAR, nearest
from sandmould.dem.surfaces import SurfaceArrays
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
from sandmould.dem.wall_history import WallHistory, recall, swap

ONE_FACE = math.cos(math.radians(10.0))
"""Contacts with normals nearer than this are one: facets of a curved wall."""
EDGE_SHOWS = 1e-3
"""Radii by which an edge must stand out of a face to be touched beside it: meshes are rounded."""
_MOST = 32
_ROUNDED = 1e-6
"""Of a gap: it is known but for round-off."""
_WAITS, _COVERED, _SEEN = 0, 1, 2


@njit(**OPTIONS)
def _next(distance: Floats, inside: Flags, state: NDArray[np.int8], touched: int) -> int:
    """Give the nearest part still waiting, or -1; of two equally near the one touched inside."""
    best, least = -1, FAR
    for i in range(touched):
        if state[i] == _WAITS and (
            distance[i] < least or (distance[i] == least and inside[i] and not inside[best])
        ):
            best, least = i, distance[i]
    return best


@njit(**OPTIONS)
def _cover(
    dim: Any,
    distance: Floats,
    normal: Floats,
    inside: Flags,
    state: NDArray[np.int8],
    touched: int,
    contact: int,
    r: float,
) -> None:
    """Rule out all that a contact covers."""
    n, near = load(dim, normal, contact), distance[contact]
    for i in range(touched):
        if state[i] == _WAITS:
            cosine = dot(n, load(dim, normal, i))
            in_front = near - distance[i] * cosine
            if cosine > ONE_FACE or in_front <= (0.0 if inside[i] else EDGE_SHOWS * r):
                state[i] = _COVERED


@njit(**OPTIONS)
def surface_forces(
    dim: Any,
    first_row: int,
    last_row: int,
    candidates: Candidates,
    position: Floats,
    velocity: Floats,
    spin: Floats,
    kind: NDArray[Any],
    radius: Floats,
    mass: Floats,
    force: Floats,
    moment: Floats,
    arrays: SurfaceArrays,
    shift: Any,
    shift_velocity: Any,
    law: Law,
    dt: float,
    keep: bool,
    history: WallHistory,
    loads: Floats,
    travel: float,
    due: Floats,
) -> None:
    """Add the forces of the surfaces to grains, and their reactions to the loads on vertices.

    Parameters
    ----------
    first_row, last_row : int
        Rows first_row ... last_row - 1 of the candidates: several threads take rows of their own.
    position, velocity : (n, d or 3) float64, m and m/s
    spin : (n, 1 or 3) float64, rad/s
    kind : (n,) integers
        Places of the grains in the next two.
    radius, mass : (k,) float64, m and kg
    force, moment : (n, d or 3) and (n, 1 or 3) float64, N and N m
        Added to.
    shift, shift_velocity : tuple of d floats, m and m/s
        Displacement and velocity of the box.
    dt : float, s
    keep : bool
        Whether this step's friction and rolling moments are kept for the next one; without it
        the forces are those of the memory as it is.
    history : WallHistory
        Row by row that of the candidates.
    loads : (nv, d) float64, N
        Force of the grains on the vertices, added to, eq. (56).
    travel : float, m
        How far grains and parts may have moved towards each other since the candidates were found.
    due : (p,) float64, m
        Travel up to which no grain reaches the candidate; no entry where all are always looked at.
    """
    # Names of their own: taking an array out of a tuple inside the loop counts references.
    rows, start, part = candidates.rows, candidates.start, candidates.part
    vertices, vertex_velocity = arrays.vertices, arrays.vertex_velocity
    planes, shape, corner = arrays.planes[0], arrays.shape, arrays.corner
    first_slot, slots_used, slot_normal = history.first_slot, history.used, history.normal
    slot_friction, slot_rolling = history.friction, history.rolling
    # Scratch: what one grain touches.
    d = len(dim)
    f_distance, f_part = np.empty(_MOST), np.empty(_MOST, dtype=np.int64)
    f_normal, f_weights = np.empty((_MOST, d)), np.empty((_MOST, d))
    f_inside, f_state = np.empty(_MOST, dtype=np.bool_), np.empty(_MOST, dtype=np.int8)
    lapse = dt if keep else 0.0
    rests = len(due) > 0
    for row in range(first_row, last_row):
        i = rows[row]
        r = radius[kind[i]]
        x = plus(load(dim, position, i), -1.0, shift)
        touched = 0
        far = 2.0 * r if rests else r
        for k in range(index(start[row]), index(start[row + 1])):
            if rests and travel < due[k]:
                continue
            p = int(part[k])
            distance, n, weights, inside = nearest(dim, vertices, planes, shape, corner, p, x, far)
            if distance >= r:
                if rests:
                    due[k] = travel + (1.0 - _ROUNDED) * (min(distance, far) - r)
                continue
            c = touched
            if touched < _MOST:
                touched += 1
            else:
                # Of too many parts the nearest count.
                c = int(np.argmax(f_distance))
                if distance >= f_distance[c]:
                    continue
            f_distance[c], f_part[c], f_inside[c] = distance, p, inside
            f_state[c] = _WAITS
            store(n, f_normal, c)
            store(weights, f_weights, c)
        old, base = int(slots_used[row]), int(first_slot[row])
        n_slots = int(first_slot[row + 1]) - base
        if touched == 0:
            if keep and old:
                slots_used[row] = 0
            continue
        speed = plus(load(dim, velocity, i), -1.0, shift_velocity)
        w = load_spin(dim, spin, i)
        total, turning = no_vector(dim), no_spin(dim)
        contacts = taken = 0
        while contacts < n_slots:
            c = _next(f_distance, f_inside, f_state, touched) if touched > 1 else 0
            if c < 0:
                break
            n, distance, weights = load(dim, f_normal, c), f_distance[c], load(dim, f_weights, c)
            f_state[c] = _SEEN
            if contacts and not f_inside[c]:
                # The edge of a concave joint is no contact: a nearer part goes on from there.
                edge = plus(x, distance, n)
                joined = False
                for k in range(touched):
                    if k != c and f_state[k] != _WAITS and f_distance[k] <= distance:
                        gap = nearest(dim, vertices, planes, shape, corner, f_part[k], edge, r)[0]
                        joined = joined or abs(gap) <= EDGE_SHOWS * r
                if joined:
                    continue
            v = times(speed, -1.0)
            for j in range(d):
                v = plus(v, weights[j], load(dim, vertex_velocity, corner[f_part[c], j]))
            friction, rolling = no_spin(dim), no_spin(dim)
            # Slots before this one are taken: no second contact may have them too.
            slot = base + taken
            k = recall(dim, slot_normal, slot, base + old, n)
            if k >= 0:
                if k > slot:
                    swap(dim, slot_normal, slot_friction, slot_rolling, k, slot)
                friction = load_spin(dim, slot_friction, slot)
                rolling = load_spin(dim, slot_rolling, slot)
                taken += 1
            elif keep:
                if taken < old < n_slots:
                    swap(dim, slot_normal, slot_friction, slot_rolling, base + old, slot)
                    old += 1
                taken += 1
            on_grain, moment_1, _, friction, rolling, _ = contact(
                n, r - distance, v, w, no_spin(dim), max(distance, 0.0), 0.0, 0.0,
                pair_coefficients(law, mass[kind[i]], r, r), law, lapse, friction, rolling,
            )  # fmt: skip
            total = plus(total, 1.0, on_grain)
            turning = plus(turning, 1.0, moment_1)
            for j in range(d):
                add_to(on_grain, -weights[j], loads, corner[f_part[c], j])
            if keep:
                store(n, slot_normal, slot)
                store(friction, slot_friction, slot)
                store(rolling, slot_rolling, slot)
            contacts += 1
            if touched == 1:
                break
            _cover(dim, f_distance, f_normal, f_inside, f_state, touched, c, r)
        if keep:
            slots_used[row] = taken
        add_to(total, 1.0, force, i)
        add_to(turning, 1.0, moment, i)
