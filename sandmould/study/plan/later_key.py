"""Which key of a study brought a misfit with a key that was right in an earlier file."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import replace
from typing import Any

from sandmould.bad_input import Problem
from sandmould.scenario.reading import Tree
from sandmould.study.plan.load_study import StudyFile


def at_later_key(
    problem: Problem,
    files: Sequence[StudyFile],
    misfits: Callable[[Sequence[StudyFile]], set[str]],
) -> Problem:
    """Tell a misfit at the key that changed, where the key that it was found at did not.

    Parameters
    ----------
    files : sequence of StudyFile
        The study's own last, each after the one that it is based on.
    misfits : callable
        Keys of the misfits that some files alone have.
    """
    of_material = not problem.key.startswith("scenario.") and problem.file not in {
        file.name for file in files
    }
    if of_material or problem.sentence:
        return problem
    number = len(files) - 1
    while number and problem.key in misfits(files[:number]):
        number -= 1
    file, below = files[number], files[:number]
    if not number or problem.file == file.name:
        return problem
    brought = _brought(
        file.tree, lambda tree: problem.key in misfits([*below, replace(file, tree=tree)])
    )
    if brought is None:
        return problem
    where = f"{problem.key} of {problem.file}, here {problem.value}"
    return Problem(*brought, f"one with which {where}, is {problem.valid}", file.name)


def _brought(tree: Tree, brings: Callable[[Tree], bool]) -> tuple[str, Any] | None:
    """The deepest key, with its value, that brings a misfit by itself."""
    for name, value in tree.items():
        if brings({name: value}):
            inner = None
            # what has a kind, or a value and its unit, is one
            if isinstance(value, dict) and not {"kind", "value"} & set(value):
                inner = _brought(value, lambda part, name=name: brings({name: part}))  # type: ignore[misc]
            return (f"{name}.{inner[0]}", inner[1]) if inner else (name, value)
    return None
