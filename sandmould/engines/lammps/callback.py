"""What LAMMPS calls in every step: the surface contacts and the damping (38) of our own solver.

No Python runs in a step: LAMMPS gets the address of a compiled function and of a table of arrays
that the session owns. The grains' own arrays are asked of LAMMPS in each call, since it moves them
when grains are inserted.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np
from numba import carray, types

from sandmould.arrays import Floats, Ints, WholeNumbers
from sandmould.compiled import cfunc, njit
from sandmould.dem.addresses import call_with_two, to_floats, to_ints
from sandmould.dem.broad_phase import Candidates, find_candidates
from sandmould.dem.motion import ISOTROPIC, damped
from sandmould.dem.surface_contacts import surface_forces
from sandmould.dem.surfaces import SurfaceArrays, farthest_moved, move_vertices
from sandmould.dem.vectors import (
    OPTIONS,
    PLANE,
    SPACE,
    add_to,
    dot,
    load,
    load_spin,
    plus,
    store,
    times,
)
from sandmould.dem.wall_history import WallHistory, carry_history
from sandmould.engines.lammps.bridge import (
    EXTRACT,
    FIRST_MOVED,
    FIRST_SHOWN,
    FORCE,
    GRAINS,
    HANDLE,
    LAST_STEP,
    LISTED,
    LOAD_EVERY,
    MASS,
    MOMENT,
    MOVER_CALL,
    MOVER_TABLE,
    RADIUS,
    ROWS,
    SPIN,
    VELOCITY,
    WINDOW,
    Bridge,
    bridge_of,
    constants_of,
    law_of,
)

_FIELDS = len(Bridge._fields)


@njit(**OPTIONS)
def _open(address: Any) -> Bridge:
    """Make the arrays out of the table at an address."""
    return bridge_of(carray(address, (_FIELDS, 3)))


@njit(**OPTIONS)
def _of_grains(bridge: Bridge, which: int) -> int:
    """Address of an array of LAMMPS; of one with rows that of its row pointers."""
    return call_with_two(bridge.counts[EXTRACT], bridge.counts[HANDLE], bridge.names[which])


@njit(**OPTIONS)
def _vectors(bridge: Bridge, which: int, n: int) -> Floats:
    """LAMMPS's array of a vector for each of n grains, (n, 3) float64."""
    first_row = carray(to_ints(_of_grains(bridge, which)), (1,))[0]
    return carray(to_floats(first_row), (n, 3))


@njit(**OPTIONS)
def _numbers(bridge: Bridge, which: int, n: int) -> Floats:
    """LAMMPS's array of a number for each of n grains, (n,) float64."""
    return carray(to_floats(_of_grains(bridge, which)), (n,))


@njit(**OPTIONS)
def _must_list(
    dim: Any, bridge: Bridge, arrays: SurfaceArrays, position: Floats, shift: Any
) -> bool:
    """Whether a grain may have come near a part that is not in its list."""
    counts, listed = bridge.counts, bridge.listed
    if not counts[LISTED] or counts[GRAINS] != len(position):
        return True
    skin_m = constants_of(bridge.constants).skin_m
    left = skin_m - farthest_moved(arrays, bridge.listed_vertices)
    if left <= 0.0:
        return True
    for i in range(len(position)):
        way = plus(plus(load(dim, position, i), -1.0, shift), -1.0, load(dim, listed, i))
        if dot(way, way) > left * left:
            return True
    return False


@njit(**OPTIONS)
def _copy(source: WholeNumbers, target: Ints) -> None:
    for i in range(len(source)):
        target[i] = source[i]


@njit(**OPTIONS)
def _clear(rows: Floats) -> None:
    for i in range(len(rows)):
        for k in range(rows.shape[1]):
            rows[i, k] = 0.0


@njit(**OPTIONS)
def _history_of(bridge: Bridge) -> WallHistory:
    return WallHistory(
        bridge.first_slot, bridge.used, bridge.normal, bridge.friction, bridge.rolling
    )


@njit(**OPTIONS)
def _list(
    dim: Any,
    bridge: Bridge,
    arrays: SurfaceArrays,
    position: Floats,
    radius: Floats,
    ids: Any,
    shift: Any,
) -> Ints:
    """List candidates, the history carried over; give their parts."""
    # A list too long for its array serves this step alone, until the session gives a longer array.
    counts = bridge.counts
    n, old_rows = len(position), counts[ROWS]
    skin_m = constants_of(bridge.constants).skin_m
    near = find_candidates(dim, position, radius, skin_m, arrays, shift)
    rows = len(near.rows)
    new_ids = np.empty(rows, dtype=np.int64)
    for k in range(rows):
        new_ids[k] = ids[near.rows[k]]
    old = _history_of(bridge)
    new = carry_history(dim, bridge.row_ids[:old_rows], old, new_ids, near.start)
    for k in range(len(new.normal)):
        store(load(dim, new.normal, k), bridge.normal, k)
        store(load_spin(dim, new.friction, k), bridge.friction, k)
        store(load_spin(dim, new.rolling, k), bridge.rolling, k)
    _copy(new.first_slot, bridge.first_slot)
    _copy(new.used, bridge.used)
    _copy(new_ids, bridge.row_ids)
    _copy(near.rows, bridge.rows)
    _copy(near.start, bridge.start)
    counts[ROWS], counts[GRAINS] = rows, n
    counts[LISTED] = 1 if len(near.part) <= len(bridge.part) else 0
    if counts[LISTED]:
        _copy(near.part, bridge.part)
    for i in range(n):
        store(plus(load(dim, position, i), -1.0, shift), bridge.listed, i)
    for i in range(len(arrays.vertices)):
        store(load(dim, arrays.vertices, i), bridge.listed_vertices, i)
    return near.part.astype(np.int64)


@njit(**OPTIONS)
def _set_motion(bridge: Bridge, step: int) -> None:
    """Ask a mover how its vertices move in a step, and let them."""
    first, load, velocity = bridge.counts[FIRST_MOVED], bridge.mover_load, bridge.mover_velocity
    for i in range(load.shape[0]):
        for k in range(load.shape[1]):
            load[i, k] = bridge.step_loads[first + i, k]
    call_with_two(bridge.counts[MOVER_CALL], bridge.counts[MOVER_TABLE], step)
    for i in range(load.shape[0]):
        bridge.steps_left[first + i] = 1
        for k in range(load.shape[1]):
            bridge.vertex_velocity[first + i, k] = velocity[i, k]


@njit(**OPTIONS)
def _press(dim: Any, bridge: Bridge, step: int, ids: Any, position: Floats, added: Floats) -> None:
    """Press the grains on the surfaces in one step."""
    # LAMMPS calls once more at the start of a run, for the step that was the last one before: the
    # forces are found anew, but nothing moves on.
    counts, displacement = bridge.counts, bridge.displacement
    n = len(position)
    _clear(added)
    arrays = SurfaceArrays(
        bridge.vertices,
        bridge.vertex_velocity,
        bridge.steps_left,
        bridge.planes,
        bridge.shape,
        bridge.corner,
    )
    moves_on = step > counts[LAST_STEP]
    dt = constants_of(bridge.constants).step_s
    if moves_on:
        if counts[MOVER_CALL]:
            _set_motion(bridge, step)
        move_vertices(arrays, dt)
        counts[LAST_STEP] = step
    last = min(max(step - counts[FIRST_SHOWN], 1), len(displacement) - 1)
    along = load(dim, bridge.direction, 0)
    shift = times(along, displacement[last])
    shift_velocity = times(along, (displacement[last] - displacement[last - 1]) / dt)
    radius = _numbers(bridge, RADIUS, n)
    part = bridge.part
    if _must_list(dim, bridge, arrays, position, shift):
        part = _list(dim, bridge, arrays, position, radius, ids, shift)
    _clear(bridge.step_loads)
    surface_forces(
        dim,
        int(np.int64(0)),  # for a literal numba would compile it once more
        counts[ROWS],
        Candidates(bridge.rows, bridge.start, part),
        position,
        _vectors(bridge, VELOCITY, n),
        _vectors(bridge, SPIN, n),
        bridge.kind,
        radius,
        _numbers(bridge, MASS, n),
        added,
        _vectors(bridge, MOMENT, n),
        arrays,
        shift,
        shift_velocity,
        law_of(bridge.law),
        dt,
        moves_on,
        _history_of(bridge),
        bridge.step_loads,
        0.0,
        np.empty(0),
    )
    if moves_on and step % counts[LOAD_EVERY] == 0:
        if (step - counts[LOAD_EVERY]) % counts[WINDOW] == 0:
            _clear(bridge.loads)
        for i in range(len(bridge.loads)):
            add_to(load(dim, bridge.step_loads, i), 1.0, bridge.loads, i)


@njit(**OPTIONS)
def _damp(dim: Any, bridge: Bridge, n: int, added: Floats) -> None:
    """Isotropic damping of all that acts on the grains so far, eqs. (38) and (39)."""
    velocity, spin = _vectors(bridge, VELOCITY, n), _vectors(bridge, SPIN, n)
    force, moment = _vectors(bridge, FORCE, n), _vectors(bridge, MOMENT, n)
    constants = constants_of(bridge.constants)
    _clear(added)
    for i in range(n):
        acting = load(dim, force, i)
        after = damped(
            acting, load(dim, velocity, i), 0.0, ISOTROPIC, constants.damping_translation
        )
        store(plus(after, -1.0, acting), added, i)
        turning = load_spin(dim, moment, i)
        rate = load_spin(dim, spin, i)
        store(damped(turning, rate, 0.0, ISOTROPIC, constants.damping_rotation), moment, i)


_SIGNATURE = types.void(
    types.CPointer(types.int64),
    types.int64,
    types.int32,
    types.CPointer(types.int32),
    types.CPointer(types.int64),
    types.CPointer(types.int64),
)


def _press_in_plane(table: Any, step: int, n: int, ids: Any, position: Any, added: Any) -> None:
    if n > 0:
        x, f = carray(to_floats(position[0]), (n, 3)), carray(to_floats(added[0]), (n, 3))
        _press(PLANE, _open(table), step, carray(ids, (n,)), x, f)


def _press_in_space(table: Any, step: int, n: int, ids: Any, position: Any, added: Any) -> None:
    if n > 0:
        x, f = carray(to_floats(position[0]), (n, 3)), carray(to_floats(added[0]), (n, 3))
        _press(SPACE, _open(table), step, carray(ids, (n,)), x, f)


def _damp_in_plane(table: Any, step: int, n: int, ids: Any, position: Any, added: Any) -> None:
    if n > 0:
        f = carray(to_floats(added[0]), (n, 3))
        _damp(PLANE, _open(table), n, f)


def _damp_in_space(table: Any, step: int, n: int, ids: Any, position: Any, added: Any) -> None:
    if n > 0:
        f = carray(to_floats(added[0]), (n, 3))
        _damp(SPACE, _open(table), n, f)


_COMPILED: dict[tuple[str, int], Any] = {}
_PLAIN: dict[tuple[str, int], Callable[..., None]] = {
    ("press", 2): _press_in_plane,
    ("press", 3): _press_in_space,
    ("damp", 2): _damp_in_plane,
    ("damp", 3): _damp_in_space,
}


def address_of(what: str, dimension: int) -> int:
    """Address of the function that LAMMPS is to call: ``press`` or ``damp``."""
    key = (what, dimension)
    if key not in _COMPILED:
        _COMPILED[key] = cfunc(_SIGNATURE)(_PLAIN[key])
    address: int = _COMPILED[key].address
    return address
