"""What LAMMPS calls in every step: the surface contacts and the damping (38) of our own solver.

No Python runs in a step: LAMMPS gets the address of a compiled function and of a table of arrays
that the session owns. The grains' own arrays are asked of LAMMPS in each call, since it moves them
when grains are inserted.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Any, NamedTuple

import numpy as np
from numba import carray, types

from sandmould.compiled import cfunc, njit
from sandmould.dem.addresses import (
    Floats,
    Ints,
    call_with_two,
    int_line_at,
    int_rows_at,
    line_at,
    rows_at,
    to_floats,
    to_ints,
)
from sandmould.dem.broad_phase import Candidates, find_candidates
from sandmould.dem.contact_law import Law
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

LAST_STEP, ROWS, GRAINS, LISTED, FIRST_SHOWN, LOAD_EVERY, WINDOW, HANDLE, EXTRACT = range(9)
MOVER_CALL, MOVER_TABLE, FIRST_MOVED = range(9, 12)
"""Places in ``Bridge.counts``."""
ALPHA_TRANSLATION, ALPHA_ROTATION, SKIN, STEP = range(8, 12)
"""Places in ``Bridge.numbers`` after the law."""
VELOCITY, SPIN, FORCE, MOMENT, RADIUS, MASS = range(6)
GRAIN_ARRAYS = (b"v", b"omega", b"f", b"torque", b"radius", b"rmass")
"""What LAMMPS calls its arrays of grains, in the order of ``Bridge.names``."""


class Bridge(NamedTuple):
    """Arrays that the session owns and the compiled function works on."""

    counts: Ints
    """(12,) int64: last step done, rows and grains of the list, whether it holds, step of the first
    displacement, steps between load samples and in a window, addresses of LAMMPS and of its
    function that gives an array, addresses of a ``StepMover`` or 0, first vertex that it moves."""
    names: Ints
    """(6,) int64: addresses of the names in ``GRAIN_ARRAYS``."""
    numbers: Floats
    """(12,) float64: the law, damping (38) and (39), skin (m), step (s)."""
    direction: Floats
    """(1, d) float64: unit vector along which the box moves."""
    displacement: Floats
    """(k,) float64, m: of the box at successive steps; the last one holds on."""
    vertices: Floats
    vertex_velocity: Floats
    steps_left: Ints
    planes: Ints
    shape: Floats
    corner: Ints
    """See ``SurfaceArrays``."""
    listed: Floats
    """(n, d) float64, m: places in the box when candidates were listed."""
    listed_vertices: Floats
    """(nv, d) float64, m."""
    rows: Ints
    start: Ints
    part: Ints
    """See ``Candidates``; longer than needed."""
    row_ids: Ints
    """(n,) int64: ids of the grains of the rows."""
    used: Ints
    normal: Floats
    friction: Floats
    rolling: Floats
    """See ``WallHistory``; longer than needed."""
    loads: Floats
    """(nv, d) float64, N: sum over the samples of a window."""
    step_loads: Floats
    """(nv, d) float64, N: loads of the last step."""
    mover_load: Floats
    mover_velocity: Floats
    """See ``StepMover``; no rows without one."""


_FIELDS = len(Bridge._fields)


@njit(**OPTIONS)
def _open(address: Any) -> Bridge:
    """Make the arrays out of the table at an address, in the order of the fields."""
    table = carray(address, (_FIELDS, 3))
    return Bridge(
        int_line_at(table, 0),
        int_line_at(table, 1),
        line_at(table, 2),
        rows_at(table, 3),
        line_at(table, 4),
        rows_at(table, 5),
        rows_at(table, 6),
        int_line_at(table, 7),
        int_line_at(table, 8),
        rows_at(table, 9),
        int_rows_at(table, 10),
        rows_at(table, 11),
        rows_at(table, 12),
        int_line_at(table, 13),
        int_line_at(table, 14),
        int_line_at(table, 15),
        int_line_at(table, 16),
        int_line_at(table, 17),
        rows_at(table, 18),
        rows_at(table, 19),
        rows_at(table, 20),
        rows_at(table, 21),
        rows_at(table, 22),
        rows_at(table, 23),
        rows_at(table, 24),
    )


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
    left = bridge.numbers[SKIN] - farthest_moved(arrays, bridge.listed_vertices)
    if left <= 0.0:
        return True
    for i in range(len(position)):
        way = plus(plus(load(dim, position, i), -1.0, shift), -1.0, load(dim, listed, i))
        if dot(way, way) > left * left:
            return True
    return False


@njit(**OPTIONS)
def _copy(source: Ints, target: Ints) -> None:
    """Copy an array to the front of a longer one."""
    for i in range(len(source)):
        target[i] = source[i]


@njit(**OPTIONS)
def _clear(rows: Floats) -> None:
    for i in range(len(rows)):
        for k in range(rows.shape[1]):
            rows[i, k] = 0.0


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
    """List candidates, the history carried over; give their parts.

    A list too long for its array serves this step alone: it is made again in the next one, until
    the session gives a longer array.
    """
    counts = bridge.counts
    n, old_rows = len(position), counts[ROWS]
    found = find_candidates(dim, position, radius, bridge.numbers[SKIN], arrays, shift)
    rows = len(found.rows)
    new_ids = np.empty(rows, dtype=np.int64)
    for k in range(rows):
        new_ids[k] = ids[found.rows[k]]
    old = WallHistory(bridge.used, bridge.normal, bridge.friction, bridge.rolling)
    new = carry_history(dim, bridge.row_ids[:old_rows], old, new_ids)
    for k in range(len(new.normal)):
        store(load(dim, new.normal, k), bridge.normal, k)
        store(load_spin(dim, new.friction, k), bridge.friction, k)
        store(load_spin(dim, new.rolling, k), bridge.rolling, k)
    _copy(new.used, bridge.used)
    _copy(new_ids, bridge.row_ids)
    _copy(found.rows, bridge.rows)
    _copy(found.start, bridge.start)
    counts[ROWS], counts[GRAINS] = rows, n
    counts[LISTED] = 1 if len(found.part) <= len(bridge.part) else 0
    if counts[LISTED]:
        _copy(found.part, bridge.part)
    for i in range(n):
        store(plus(load(dim, position, i), -1.0, shift), bridge.listed, i)
    for i in range(len(arrays.vertices)):
        store(load(dim, arrays.vertices, i), bridge.listed_vertices, i)
    return found.part


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
    """Press the grains on the surfaces in one step.

    LAMMPS calls once more at the start of a run, for the step that was the last one before: the
    forces are found anew, but nothing moves on.
    """
    counts, numbers, displacement = bridge.counts, bridge.numbers, bridge.displacement
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
    dt = numbers[STEP]
    if moves_on:
        if counts[MOVER_CALL]:
            _set_motion(bridge, step)
        move_vertices(arrays, dt)
        counts[LAST_STEP] = step
    shown = min(max(step - counts[FIRST_SHOWN], 1), len(displacement) - 1)
    along = load(dim, bridge.direction, 0)
    shift = times(along, displacement[shown])
    shift_velocity = times(along, (displacement[shown] - displacement[shown - 1]) / dt)
    radius = _numbers(bridge, RADIUS, n)
    part = bridge.part
    if _must_list(dim, bridge, arrays, position, shift):
        part = _list(dim, bridge, arrays, position, radius, ids, shift)
    _clear(bridge.step_loads)
    law = Law(
        numbers[0],
        numbers[1],
        numbers[2],
        numbers[3],
        numbers[4],
        numbers[5],
        numbers[6] != 0.0,
        numbers[7] != 0.0,
    )
    surface_forces(
        dim,
        0,
        counts[ROWS],
        Candidates(bridge.rows, bridge.start, part),
        position,
        _vectors(bridge, VELOCITY, n),
        _vectors(bridge, SPIN, n),
        radius,
        _numbers(bridge, MASS, n),
        added,
        _vectors(bridge, MOMENT, n),
        arrays,
        shift,
        shift_velocity,
        law,
        dt,
        moves_on,
        WallHistory(bridge.used, bridge.normal, bridge.friction, bridge.rolling),
        bridge.step_loads,
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
    alpha_t, alpha_r = bridge.numbers[ALPHA_TRANSLATION], bridge.numbers[ALPHA_ROTATION]
    _clear(added)
    for i in range(n):
        acting = load(dim, force, i)
        after = damped(acting, load(dim, velocity, i), 0.0, ISOTROPIC, alpha_t)
        store(plus(after, -1.0, acting), added, i)
        turning = load_spin(dim, moment, i)
        store(damped(turning, load_spin(dim, spin, i), 0.0, ISOTROPIC, alpha_r), moment, i)


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
