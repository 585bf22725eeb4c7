"""The table of arrays that a session of LAMMPS and the compiled function in its steps share.

Fields and their types are listed once, in the named tuples; compiled code reads them by that list.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Annotated, Any, NamedTuple, get_args, get_type_hints

from numba import types
from numba.extending import intrinsic

from sandmould.arrays import Floats, Ints
from sandmould.dem.addresses import int_line_at, int_rows_at, line_at, rows_at
from sandmould.dem.contact_law import Law

COUNTS = 12
(
    LAST_STEP, ROWS, GRAINS, LISTED, FIRST_SHOWN, LOAD_EVERY, WINDOW, HANDLE, EXTRACT, MOVER_CALL,
    MOVER_TABLE, FIRST_MOVED,
) = range(COUNTS)  # fmt: skip
"""Places in ``Bridge.counts``."""
VELOCITY, SPIN, FORCE, MOMENT, RADIUS, MASS = range(6)
GRAIN_ARRAYS = (b"v", b"omega", b"f", b"torque", b"radius", b"rmass")
"""What LAMMPS calls its arrays of grains, in the order of ``Bridge.names``."""


IntLine = Annotated[Ints, types.int64[::1]]
IntRows = Annotated[Ints, types.int64[:, ::1]]
Line = Annotated[Floats, types.float64[::1]]
Rows = Annotated[Floats, types.float64[:, ::1]]
_ARRAY_AT = {
    types.int64[::1]: int_line_at,
    types.int64[:, ::1]: int_rows_at,
    types.float64[::1]: line_at,
    types.float64[:, ::1]: rows_at,
}


class Constants(NamedTuple):
    """Numbers beside the contact law that stay the same in all steps."""

    damping_translation: float
    """alpha^nvt of eq. (38)."""
    damping_rotation: float
    """alpha^nvr of eq. (39)."""
    skin_m: float
    step_s: float


class Bridge(NamedTuple):
    """Arrays that the session owns and the compiled function works on."""

    counts: IntLine
    """(12,) int64: last step done, rows and grains of the list, whether it holds, step of the first
    displacement, steps between load samples and in a window, addresses of LAMMPS and of its
    function that gives an array, addresses of a ``StepMover`` or 0, first vertex that it moves."""
    names: IntLine
    """(6,) int64: addresses of the names in ``GRAIN_ARRAYS``."""
    law: Line
    """(f,) float64: the f fields of ``Law``."""
    constants: Line
    """(4,) float64: the fields of ``Constants``."""
    direction: Rows
    """(1, d) float64: unit vector along which the box moves."""
    displacement: Line
    """(k,) float64, m: of the box at successive steps; the last one holds on."""
    vertices: Rows
    vertex_velocity: Rows
    steps_left: IntLine
    planes: IntLine
    shape: Rows
    corner: IntRows
    """See ``SurfaceArrays``."""
    listed: Rows
    """(n, d) float64, m: places in the box when candidates were listed."""
    listed_vertices: Rows
    """(nv, d) float64, m."""
    rows: IntLine
    start: IntLine
    part: IntLine
    """See ``Candidates``; longer than needed."""
    row_ids: IntLine
    """(n,) int64: ids of the grains of the rows."""
    first_slot: IntLine
    used: IntLine
    normal: Rows
    friction: Rows
    rolling: Rows
    """See ``WallHistory``; longer than needed."""
    kind: IntLine
    """(n,) int64: 0, 1, ...: each grain is of a kind of its own."""
    loads: Rows
    """(nv, d) float64, N: sum over the samples of a window."""
    step_loads: Rows
    """(nv, d) float64, N: loads of the last step."""
    mover_load: Rows
    mover_velocity: Rows
    """See ``StepMover``; no rows without one."""


def _reader(named: Any, kind_of: Callable[[Any], Any], field_at: Callable[[Any, int], Any]) -> Any:
    """Make the compiled function that reads a named tuple, field by field, out of an array."""
    kinds = [kind_of(hint) for hint in get_type_hints(named, include_extras=True).values()]

    @intrinsic
    def read(typing_context: Any, array: Any) -> Any:
        def generate(context: Any, builder: Any, signature: Any, args: Any) -> Any:
            fields = [
                context.compile_internal(builder, field_at(kind, k), kind(array), args)
                for k, kind in enumerate(kinds)
            ]
            return context.make_tuple(builder, signature.return_type, fields)

        return types.BaseTuple.from_types(kinds, named)(array), generate

    return read


def _array_at(kind: Any, k: int) -> Callable[[Any], Any]:
    array_at = _ARRAY_AT[kind]
    return lambda table: array_at(table, k)


def _number_at(kind: Any, k: int) -> Callable[[Any], Any]:
    if kind is types.boolean:
        return lambda numbers: numbers[k] != 0.0
    return lambda numbers: numbers[k]


_KINDS = {float: types.float64, bool: types.boolean}
bridge_of = _reader(Bridge, lambda hint: get_args(hint)[1], _array_at)
law_of = _reader(Law, _KINDS.__getitem__, _number_at)
constants_of = _reader(Constants, _KINDS.__getitem__, _number_at)
