"""Numbers in lanes: one value of compiled code that stands for W grains or pairs at once.

``Lanes`` are W floats and ``Places`` W row numbers, vectors of the machine. Operators, ``sqrt``,
``abs``, ``max`` and ``min`` take lanes beside plain numbers, so one text of a law compiles for
either. Nothing is rounded in another way than for plain numbers, and ``fused`` is one rounding on
every processor: digits depend on no width. Compiled code takes W from the length of a tuple, as it
takes the dimension. These functions exist in compiled code alone.
"""

from __future__ import annotations

import math
import operator
from collections.abc import Callable
from typing import Any

import numba
from llvmlite import binding, ir
from numba import types
from numba.core import cgutils
from numba.extending import intrinsic, models, overload, register_model

_BIT, _BYTE, _WORD, _LONG, _DOUBLE = *map(ir.IntType, (1, 8, 32, 64)), ir.DoubleType()


_compiled: Any = intrinsic
"""Of any number of arguments, which its own type does not tell."""


class Lanes(types.Type):
    """W floats of 64 bits."""

    def __init__(self, width: int) -> None:
        """Of a number of lanes."""
        self.vector = ir.VectorType(_DOUBLE, width)
        super().__init__(f"Lanes({width})")


class Mask(types.Type):
    """W truth values."""

    def __init__(self, width: int) -> None:
        """Of a number of lanes."""
        self.vector = ir.VectorType(_BIT, width)
        super().__init__(f"Mask({width})")


class Places(types.Type):
    """W row numbers."""

    def __init__(self, width: int) -> None:
        """Of a number of lanes."""
        self.vector = ir.VectorType(_LONG, width)
        super().__init__(f"Places({width})")


@register_model(Lanes)
@register_model(Mask)
@register_model(Places)
class _VectorModel(models.PrimitiveModel):
    def __init__(self, manager: Any, kind: Any) -> None:
        super().__init__(manager, kind, kind.vector)


def lanes_of_processor() -> tuple[float, ...]:
    """As many zeros as its vectors hold doubles, two at least."""
    features = numba.config.CPU_FEATURES  # type: ignore[attr-defined]
    if features is None:
        features = binding.get_host_cpu_features().flatten()
    return (0.0,) * (8 if "+avx512f" in features else 4 if "+avx2" in features else 2)


def _every(builder: Any, number: Any, vector: Any) -> Any:
    """A number in every lane."""
    undefined = ir.Constant(vector, ir.Undefined)
    one = builder.insert_element(undefined, number, ir.Constant(_WORD, 0))
    return builder.shuffle_vector(
        one, undefined, ir.Constant(ir.VectorType(_WORD, vector.count), None)
    )


def _like(context: Any, builder: Any, signature: Any, args: Any, wanted: Any) -> list[Any]:
    """Arguments as lanes where one of them is, as plain floats otherwise."""
    alike = []
    for value, kind in zip(args, signature.args, strict=True):
        if kind != wanted:
            value = context.cast(builder, value, kind, types.float64)
            if isinstance(wanted, Lanes):
                value = _every(builder, value, wanted.vector)
        alike.append(value)
    return alike


def _widest(*kinds: Any) -> Any:
    return next((kind for kind in kinds if isinstance(kind, Lanes)), types.float64)


def _of_lanes(arguments: int, build: Callable[..., Any], gives: Any = lambda kind: kind) -> Any:
    """Compiled function of one, two or three numbers, some of them lanes."""

    def typed(*kinds: Any) -> Any:
        wanted = _widest(*kinds)

        def code(context: Any, builder: Any, signature: Any, args: Any) -> Any:
            return build(builder, *_like(context, builder, signature, args, wanted))

        return gives(wanted)(*kinds), code

    versions: dict[int, Any] = {
        1: lambda typing_context, a: typed(a),
        2: lambda typing_context, a, b: typed(a, b),
        3: lambda typing_context, a, b, c: typed(a, b, c),
    }
    return intrinsic(versions[arguments])


def _called(name: str) -> Callable[..., Any]:
    """Build the call of a function of LLVM for vectors and plain floats."""

    def build(builder: Any, *args: Any) -> Any:
        kind = args[0].type
        suffix = f"v{kind.count}f64" if isinstance(kind, ir.VectorType) else "f64"
        declared = ir.FunctionType(kind, [kind] * len(args))
        full = f"llvm.{name}.{suffix}"
        return builder.call(cgutils.get_or_insert_function(builder.module, declared, full), args)

    return build


def _compared(sign: str) -> Any:
    def build(builder: Any, a: Any, b: Any) -> Any:
        return builder.fcmp_ordered(sign, a, b)

    return _of_lanes(2, build, lambda kind: Mask(kind.vector.count))


def _chosen(sign: str) -> Any:
    def build(builder: Any, a: Any, b: Any) -> Any:
        return builder.select(builder.fcmp_ordered(sign, a, b), a, b)

    return _of_lanes(2, build)


fused = _of_lanes(3, _called("fma"))
"""a b + c, rounded once: fused(a, b, c)."""
_TWO = {
    operator.add: _of_lanes(2, lambda builder, a, b: builder.fadd(a, b)),
    operator.sub: _of_lanes(2, lambda builder, a, b: builder.fsub(a, b)),
    operator.mul: _of_lanes(2, lambda builder, a, b: builder.fmul(a, b)),
    operator.truediv: _of_lanes(2, lambda builder, a, b: builder.fdiv(a, b)),
    operator.lt: _compared("<"),
    operator.gt: _compared(">"),
    max: _chosen(">"),
    min: _chosen("<"),
}
_ONE = {
    math.sqrt: _of_lanes(1, _called("sqrt")),
    abs: _of_lanes(1, _called("fabs")),
    operator.neg: _of_lanes(1, lambda builder, a: builder.fneg(a)),
}


def _register_two(function: Any, on_lanes: Any) -> None:
    @overload(function, strict=False)
    def choose(a: Any, b: Any) -> Any:
        if isinstance(a, Lanes) or isinstance(b, Lanes):
            return lambda a, b: on_lanes(a, b)
        return None


def _register_one(function: Any, on_lanes: Any) -> None:
    @overload(function, strict=False)
    def choose(a: Any) -> Any:
        return (lambda a: on_lanes(a)) if isinstance(a, Lanes) else None


for _function, _on_lanes in _TWO.items():
    _register_two(_function, _on_lanes)
for _function, _on_lanes in _ONE.items():
    _register_one(_function, _on_lanes)


@_compiled
def every(typing_context: Any, lanes: Any, number: Any) -> Any:
    """A plain number in all of W lanes: every(lanes, number)."""
    wanted = Lanes(lanes.count)

    def code(context: Any, builder: Any, signature: Any, args: Any) -> Any:
        return _every(builder, args[1], wanted.vector)

    return wanted(lanes, types.float64), code


@_compiled
def where(typing_context: Any, condition: Any, a: Any, b: Any) -> Any:
    """One number where a condition holds, another where it does not: where(condition, a, b)."""
    wanted = Lanes(condition.vector.count) if isinstance(condition, Mask) else _widest(a, b)

    def code(context: Any, builder: Any, signature: Any, args: Any) -> Any:
        of_numbers = wanted(*signature.args[1:])
        return builder.select(args[0], *_like(context, builder, of_numbers, args[1:], wanted))

    return wanted(condition, a, b), code


@_compiled
def any_of(typing_context: Any, mask: Any) -> Any:
    """Whether a condition holds in any lane."""

    def code(context: Any, builder: Any, signature: Any, args: Any) -> Any:
        bits = ir.IntType(mask.vector.count)
        return builder.icmp_unsigned("!=", builder.bitcast(args[0], bits), bits(0))

    return types.boolean(mask), code


@_compiled
def but(typing_context: Any, mask: Any, places: Any, others: Any) -> Any:
    """A condition where two places differ, false where they are the same."""

    def code(context: Any, builder: Any, signature: Any, args: Any) -> Any:
        return builder.and_(args[0], builder.icmp_unsigned("!=", args[1], args[2]))

    return mask(mask, places, others), code


@_compiled
def beside(typing_context: Any, places: Any, columns: Any, others: Any) -> Any:
    """Places in a table of rows and columns that lies row by row: beside(row, columns, column)."""

    def code(context: Any, builder: Any, signature: Any, args: Any) -> Any:
        wide = _every(builder, context.cast(builder, args[1], columns, types.int64), args[0].type)
        return builder.add(builder.mul(args[0], wide), args[2])

    return places(places, columns, others), code


@_compiled
def largest_of(typing_context: Any, lanes: Any) -> Any:
    """Largest of all lanes, or not a number where one is none."""

    def code(context: Any, builder: Any, signature: Any, args: Any) -> Any:
        largest = builder.extract_element(args[0], _WORD(0))
        for k in range(1, lanes.vector.count):
            other = builder.extract_element(args[0], _WORD(k))
            keeps = builder.fcmp_unordered(">=", largest, other)
            keeps = builder.and_(keeps, builder.fcmp_ordered("ord", other, other))
            largest = builder.select(keeps, largest, other)
        return largest

    return types.float64(lanes), code


def _start(context: Any, builder: Any, kind: Any, array: Any) -> Any:
    return context.make_array(kind)(context, builder, array).data


def _address(builder: Any, start: Any, at: Any, vector: Any) -> Any:
    return builder.bitcast(builder.gep(start, [at]), vector.as_pointer())


@_compiled
def places_at(typing_context: Any, lanes: Any, array: Any, i: Any) -> Any:
    """W row numbers of a line of uint32 from item i on: places_at(lanes, array, i)."""
    places = Places(lanes.count)

    def code(context: Any, builder: Any, signature: Any, args: Any) -> Any:
        start, words = _start(context, builder, array, args[1]), ir.VectorType(_WORD, lanes.count)
        loaded = builder.load(_address(builder, start, args[2], words))
        loaded.align = 4
        return builder.zext(loaded, places.vector)

    return places(lanes, array, i), code


@_compiled
def kinds_at(typing_context: Any, array: Any, places: Any) -> Any:
    """Bytes of a line at W places, as places."""

    def code(context: Any, builder: Any, signature: Any, args: Any) -> Any:
        start, found = _start(context, builder, array, args[0]), ir.Constant(places.vector, None)
        for k in range(places.vector.count):
            place = builder.extract_element(args[1], _WORD(k))
            number = builder.zext(builder.load(builder.gep(start, [place])), _LONG)
            found = builder.insert_element(found, number, _WORD(k))
        return found

    return places(array, places), code


def _gathered(builder: Any, start: Any, at: Any, columns: int) -> list[Any]:
    """Columns of the rows that begin at W items, one vector a column."""
    width = at.type.count
    vector, found = ir.VectorType(_DOUBLE, width), []
    if width >= 8:  # the machine gathers by itself
        pointers = ir.VectorType(_DOUBLE.as_pointer(), width)
        name = f"llvm.masked.gather.v{width}f64.v{width}p0"
        mask = ir.VectorType(_BIT, width)
        declared = ir.FunctionType(vector, [pointers, _WORD, mask, vector])
        gather = cgutils.get_or_insert_function(builder.module, declared, name)
        every = ir.Constant(mask, [1] * width)
        address = builder.mul(at, _every(builder, _LONG(8), at.type))
        address = builder.add(address, _every(builder, builder.ptrtoint(start, _LONG), at.type))
        for column in range(columns):
            here = builder.add(address, _every(builder, _LONG(8 * column), at.type))
            nothing, pointer = ir.Constant(vector, None), builder.inttoptr(here, pointers)
            found.append(builder.call(gather, [pointer, _WORD(8), every, nothing]))
        return found
    items = [builder.gep(start, [builder.extract_element(at, _WORD(k))]) for k in range(width)]
    for column in range(columns):
        lanes = ir.Constant(vector, ir.Undefined)
        for k, item in enumerate(items):
            number = builder.load(builder.gep(item, [_LONG(column)]))
            lanes = builder.insert_element(lanes, number, _WORD(k))
        found.append(lanes)
    return found


@_compiled
def rows_at(typing_context: Any, like: Any, array: Any, places: Any) -> Any:
    """Rows of an array at W places, as a tuple of lanes as long as a tuple: rows_at(like, a, p).

    The array has as many columns, or is a line where the tuple has one component.
    """
    columns, rows = like.count, types.UniTuple(Lanes(places.vector.count), like.count)

    def code(context: Any, builder: Any, signature: Any, args: Any) -> Any:
        start, vector = _start(context, builder, array, args[1]), places.vector
        at = builder.mul(args[2], _every(builder, _LONG(columns), vector))
        return context.make_tuple(builder, rows, _gathered(builder, start, at, columns))

    return rows(like, array, places), code


@_compiled
def put_rows(typing_context: Any, rows: Any, array: Any, places: Any) -> Any:
    """Write a tuple of lanes to the rows of an array at W places."""

    def code(context: Any, builder: Any, signature: Any, args: Any) -> Any:
        start, columns = _start(context, builder, array, args[1]), rows.count
        vectors = cgutils.unpack_tuple(builder, args[0], columns)
        for k in range(places.vector.count):
            place = builder.mul(builder.extract_element(args[2], _WORD(k)), _LONG(columns))
            for column, vector in enumerate(vectors):
                item = builder.gep(start, [builder.add(place, _LONG(column))])
                builder.store(builder.extract_element(vector, _WORD(k)), item)
        return context.get_dummy_value()

    return types.none(rows, array, places), code


@_compiled
def columns_at(typing_context: Any, like: Any, array: Any, i: Any) -> Any:
    """Tuple of lanes like another that lies component by component from item i of a line on."""

    def code(context: Any, builder: Any, signature: Any, args: Any) -> Any:
        start, vector, found = _start(context, builder, array, args[1]), like.dtype.vector, []
        for k in range(like.count):
            at = builder.add(args[2], ir.Constant(args[2].type, k * vector.count))
            loaded = builder.load(_address(builder, start, at, vector))
            loaded.align = 8
            found.append(loaded)
        return context.make_tuple(builder, like, found)

    return like(like, array, i), code


@_compiled
def put_columns(typing_context: Any, columns: Any, array: Any, i: Any) -> Any:
    """Write a tuple of lanes component by component from item i of a line on."""

    def code(context: Any, builder: Any, signature: Any, args: Any) -> Any:
        start, vector = _start(context, builder, array, args[1]), columns.dtype.vector
        for k, lanes in enumerate(cgutils.unpack_tuple(builder, args[0], columns.count)):
            at = builder.add(args[2], ir.Constant(args[2].type, k * vector.count))
            stored = builder.store(lanes, _address(builder, start, at, vector))
            stored.align = 8
        return context.get_dummy_value()

    return types.none(columns, array, i), code
