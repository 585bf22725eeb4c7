"""Compiled functions that a process has called, for another that is to load them before.

Apart from what compiles, so that no change of what calls this has all kernels compiled anew.
"""

from __future__ import annotations

import contextlib
import inspect
import json
import os
import sys
from collections.abc import Iterable
from pathlib import Path
from typing import Any

import numba
import numpy as np
from numba import types
from numba.core.dispatcher import Dispatcher

from sandmould.compiled import DISPATCHERS, FOLDER, KEEPS


def loaded_kernels() -> set[str]:
    """Functions that Python has called in this process, each with the types of its arguments.

    Each is a line of JSON. Those with types of other sorts than the house's own are left out.
    """
    kernels = set()
    for name, dispatcher in DISPATCHERS.items():
        if not dispatcher.signatures or _starts_threads(dispatcher):
            continue
        for signature in dispatcher.signatures:
            with contextlib.suppress(TypeError):
                kernels.add(json.dumps([name, [_described(each) for each in signature]]))
    return kernels


def load_kernels(kernels: Iterable[str]) -> None:
    """Load functions before they are called, as another process had them; none is called."""
    for kernel in kernels:
        name, described = json.loads(kernel)
        if name in DISPATCHERS and not _starts_threads(DISPATCHERS[name]):
            DISPATCHERS[name].compile(tuple(_type_of(each) for each in described))


def keep_kernels(of: str, kernels: Iterable[str]) -> None:
    """Note for later processes what some sort of runs has called, beside its machine code."""
    if KEEPS:
        path = _kept_file(of)
        partial = path.with_suffix(f".{os.getpid()}")
        partial.write_text("\n".join(sorted({*kept_kernels(of), *kernels})), encoding="utf-8")
        partial.replace(path)


def kept_kernels(of: str) -> set[str]:
    """What runs of a sort have called until now, on this machine with this state of the house."""
    try:
        return set(_kept_file(of).read_text(encoding="utf-8").splitlines()) if KEEPS else set()
    except OSError:
        return set()


def _kept_file(of: str) -> Path:
    return FOLDER / f"called_{of}.txt"


def _starts_threads(dispatcher: Any) -> bool:
    """Whether a function calls, at any depth, a parallel one.

    Threads would not live on in a fork. And Numba notes that a function needs them where it
    compiles its callees too: kept with callees that came from the disk, and loaded before any
    thread was started, it lacks their symbols and crashes where it is called.
    """
    if dispatcher not in DISPATCHERS.values():
        return True
    seen = inspect.getclosurevars(dispatcher.py_func)
    named = (*seen.globals.values(), *seen.nonlocals.values())
    return any(isinstance(each, Dispatcher) and _starts_threads(each) for each in named)


def _described(kind: Any) -> Any:
    """A type of numba's as JSON; a TypeError for one of a sort that no kernel of ours has."""
    if isinstance(kind, types.Array):
        return ["array", str(kind.dtype), kind.ndim, kind.layout, kind.mutable]
    if isinstance(kind, types.Tuple | types.UniTuple | types.NamedTuple | types.NamedUniTuple):
        of = getattr(kind, "instance_class", tuple)
        return ["tuple", of.__module__, of.__qualname__, [_described(each) for each in kind.types]]
    if type(kind) in (types.Integer, types.Float, types.Boolean):
        return str(kind)
    raise TypeError(kind)


def _type_of(described: Any) -> Any:
    """The type that ``_described`` gave; classes are those of modules that are loaded already."""
    if isinstance(described, str):
        return numba.from_dtype(np.dtype(described))
    if described[0] == "array":
        _, dtype, dimensions, layout, mutable = described
        return types.Array(_type_of(dtype), dimensions, layout, readonly=not mutable)
    _, module, name, parts = described
    of = getattr(sys.modules[module], name)
    return types.BaseTuple.from_types(
        [_type_of(each) for each in parts], None if of is tuple else of
    )
