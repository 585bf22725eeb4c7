"""What runs of a kind and an engine need, loaded before one begins."""

from __future__ import annotations

import contextlib
import sys
from typing import Any

from sandmould.kinds.registry import kind_of
from sandmould.runs.provenance import commit, processor, versions

_COMPILING = "sandmould.compiled"


def load_for(scenario: Any) -> None:
    """Load what computes and measures runs like one, and the compiled code that they called."""
    kind = kind_of(scenario)
    kind.execution.load_computing(scenario)
    kind.execution.load_measuring(scenario)
    with contextlib.suppress(Exception):  # a damaged list; what is not loaded is compiled later
        if _COMPILING in sys.modules:
            from sandmould.called_kernels import kept_kernels, load_kernels

            load_kernels(kept_kernels(_class_of(scenario)) - loaded())
    kind.planning.template_hash(scenario)
    for asked_once in (commit, versions, processor):
        asked_once()


def loaded() -> set[str]:
    """Compiled code that this process has called; what compiles is not imported to ask."""
    if _COMPILING not in sys.modules:
        return set()
    from sandmould.called_kernels import loaded_kernels

    return loaded_kernels()


def keep_loaded(scenario: Any, before: set[str]) -> None:
    """Note for later servers what a run has called that was not loaded before."""
    if new := loaded() - before:
        from sandmould.called_kernels import keep_kernels

        keep_kernels(_class_of(scenario), new)


def _class_of(scenario: Any) -> str:
    engine, dimension = kind_of(scenario).planning.speed_class(scenario)
    return f"{engine}_{dimension}"
