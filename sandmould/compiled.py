"""The one way to compile: numba with the cache folder of this state of all kernels.

Without a folder of one's own nothing is kept.
"""

from __future__ import annotations

import contextlib
import fcntl
import sys
from collections.abc import Callable
from typing import Any, TypeVar

import numba
from llvmlite import binding
from numba.core.caching import UserProvidedCacheLocator

from sandmould.kernel_cache import cache_folder, is_own

_Function = TypeVar("_Function", bound=Callable[..., Any])
FOLDER = cache_folder()
KEEPS = is_own(FOLDER)
"""Whether machine code is kept for the next process."""
if not KEEPS:
    print(
        f"Sandmould compiles its own code anew in every process, which takes time. {FOLDER} cannot "
        "be made, or others can write to it. Set XDG_CACHE_HOME to a folder of your own.",
        file=sys.stderr,
    )
# Numba reads it where a function is decorated: nothing else may set it.
numba.config.CACHE_DIR = str(FOLDER)  # type: ignore[attr-defined]
# Functions begin lines of the processor's cache, 64 bytes: taken from the disk they lie elsewhere
# than freshly compiled, and the same instructions were a quarter slower where they began in the
# middle of a line.
binding.set_option("sandmould", "-align-all-functions=6")


class OfAModule(UserProvidedCacheLocator):
    """A folder for each module, not for each path: other copies of the house find it too."""

    def __init__(self, function: Any, file: str) -> None:
        super().__init__(function, file)
        self._cache_path = str(FOLDER / function.__module__)


numba.config.CACHE_LOCATOR_CLASSES = f"{__name__}.OfAModule"  # type: ignore[attr-defined]
DISPATCHERS: dict[str, Any] = {}
"""Functions that this process may call on one thread, by module and name."""


def njit(**options: Any) -> Callable[[_Function], _Function]:
    """Compile a function for compiled code and for Python; options are those of ``numba.njit``."""

    def compiled(function: _Function) -> _Function:
        # C code calls none of them: a face for it would be a tenth of the time of compiling.
        chosen = {"cache": KEEPS, "no_cfunc_wrapper": True} | options
        dispatcher: Any = _saved_alone(numba.njit(**chosen)(function))
        if not options.get("parallel"):  # loading one of these may start threads
            DISPATCHERS[f"{function.__module__}.{function.__qualname__}"] = dispatcher
        return dispatcher

    return compiled


def cfunc(signature: Any, **options: Any) -> Callable[[Callable[..., Any]], Any]:
    """Compile a function that C code calls by its ``address``; options as ``numba.cfunc``."""
    compiled: Callable[[Callable[..., Any]], Any] = numba.cfunc(signature, cache=KEEPS, **options)
    return lambda function: _saved_alone(compiled(function))


def _saved_alone(compiled: Any) -> Any:
    """Let one process at a time keep machine code of a function.

    Two that keep it for other types at once give both the same file: later processes would load
    the code of the other types, and some of them crash (numba's issue 10128).
    """
    if KEEPS:
        file = compiled._cache._cache_file
        save = file.save

        def alone(*given: Any) -> None:
            with (FOLDER / "saving").open("w") as lock:
                with contextlib.suppress(OSError):  # a file system without locks
                    fcntl.flock(lock, fcntl.LOCK_EX)
                save(*given)

        file.save = alone
    return compiled
