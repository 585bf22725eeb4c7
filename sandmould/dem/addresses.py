"""Arrays known by their addresses: how a program in another language hands us its memory.

A table lists the address and the shape of each array, one a row. These functions exist in compiled
code alone; none of them can tell a wrong address.
"""

from __future__ import annotations

from typing import Any

import numpy as np
from llvmlite import ir
from numba import carray, types
from numba.extending import intrinsic

from sandmould.arrays import Floats, Ints
from sandmould.compiled import njit
from sandmould.dem.vectors import OPTIONS


def table_of(arrays: Any) -> Ints:
    """Addresses and shapes of arrays of at most two dimensions, (k, 3) int64."""
    return np.array([[a.ctypes.data, *a.shape, 1][:3] for a in arrays], dtype=np.int64)


def _pointer_to(kind: Any) -> Any:
    @intrinsic
    def pointer(typing_context: Any, address: Any) -> Any:
        def generate(context: Any, builder: Any, signature: Any, args: Any) -> Any:
            return builder.inttoptr(args[0], context.get_value_type(signature.return_type))

        return types.CPointer(kind)(types.int64), generate

    return pointer


to_floats, to_ints = _pointer_to(types.float64), _pointer_to(types.int64)
"""Pointers of compiled code out of addresses."""


def _call_with_two(typing_context: Any, function: Any, first: Any, second: Any) -> Any:
    def generate(context: Any, builder: Any, signature: Any, args: Any) -> Any:
        word = ir.IntType(64)
        called = builder.inttoptr(args[0], ir.FunctionType(word, [word, word]).as_pointer())
        return builder.call(called, args[1:])

    return types.int64(types.int64, types.int64, types.int64), generate


call_with_two: Any = intrinsic(_call_with_two)
"""Call a function of two addresses that gives an address, by its own."""


@njit(**OPTIONS)
def line_at(table: Ints, k: int) -> Floats:
    """Array (n,) float64 of row k of a table."""
    return carray(to_floats(table[k, 0]), (table[k, 1],))


@njit(**OPTIONS)
def rows_at(table: Ints, k: int) -> Floats:
    """Array (n, m) float64 of row k of a table."""
    return carray(to_floats(table[k, 0]), (table[k, 1], table[k, 2]))


@njit(**OPTIONS)
def int_line_at(table: Ints, k: int) -> Ints:
    """Array (n,) int64 of row k of a table."""
    return carray(to_ints(table[k, 0]), (table[k, 1],))


@njit(**OPTIONS)
def int_rows_at(table: Ints, k: int) -> Ints:
    """Array (n, m) int64 of row k of a table."""
    return carray(to_ints(table[k, 0]), (table[k, 1], table[k, 2]))
