"""A barrier for threads that run compiled code side by side.

Numba's own parallel loops start and join threads at each loop and take no tuples of arrays; a
step of a few thousand grains is too short for that.
"""

from __future__ import annotations

from typing import Any

import numpy as np
from llvmlite import ir
from numba import types
from numba.core import cgutils
from numba.extending import intrinsic

from sandmould.arrays import Ints
from sandmould.compiled import njit
from sandmould.dem.vectors import OPTIONS

_ARRIVED, _TURN = 0, 8
"""Places of the two counters, a cache line apart."""
_SPINS = 20_000
"""Looks at the other threads before the core is offered to somebody else."""
_sched_yield = types.ExternalFunction("sched_yield", types.intc())


def new_barrier() -> Ints:
    """Counters of a barrier that nobody has reached yet."""
    return np.zeros(16, dtype=np.int64)


def _place(context: Any, builder: Any, signature: Any, args: Any) -> Any:
    array = context.make_array(signature.args[0])(context, builder, args[0])
    return cgutils.gep(builder, array.data, args[1])


def _add(typing_context: Any, counters: Any, place: Any, more: Any) -> Any:
    """Add to a counter at once for all threads; gives its value before."""

    def code(context: Any, builder: Any, signature: Any, args: Any) -> Any:
        pointer = _place(context, builder, signature, args)
        return builder.atomic_rmw("add", pointer, args[2], "seq_cst")

    return types.int64(counters, types.int64, types.int64), code


def _look(typing_context: Any, counters: Any, place: Any) -> Any:
    """Read a counter as the other threads left it."""

    def code(context: Any, builder: Any, signature: Any, args: Any) -> Any:
        pointer = _place(context, builder, signature, args)
        return builder.load_atomic(pointer, "seq_cst", 8, typ=ir.IntType(64))

    return types.int64(counters, types.int64), code


_add_at_once: Any = intrinsic(_add)
_look_now: Any = intrinsic(_look)


@njit(**OPTIONS)
def wait_for_all(counters: Ints, threads: int) -> None:
    """Return when all threads have come here."""
    if threads == 1:
        return
    turn = _look_now(counters, _TURN)
    if _add_at_once(counters, _ARRIVED, 1) == threads - 1:
        _add_at_once(counters, _ARRIVED, -threads)
        _add_at_once(counters, _TURN, 1)
        return
    spins = 0
    while _look_now(counters, _TURN) == turn:
        spins += 1
        if spins > _SPINS:
            _sched_yield()
