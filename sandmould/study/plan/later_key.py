"""Which key of a study brought a misfit with a key that was right in an earlier file."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from functools import partial
from pathlib import Path
from typing import Any

from sandmould.bad_input import Problem
from sandmould.scenario.reading import Tree


@dataclass(frozen=True)
class StudyFile:
    """One file of a study or material as it was read."""

    path: Path
    name: str
    """In messages."""
    tree: Tree


def at_later_key(
    problem: Problem,
    files: Sequence[StudyFile],
    wrong_keys: Callable[[Sequence[StudyFile]], set[str]],
) -> Problem:
    """Tell a misfit at the key that changed, where the key that it was found at did not.

    Parameters
    ----------
    problem : Problem
    files : sequence of StudyFile
        The study's own last, each after the one that it is based on.
    wrong_keys : callable
        Keys of the misfits that some files alone have.
    """
    number = len(files) - 1
    while number and problem.key in wrong_keys(files[:number]):
        number -= 1
    file, below = files[number], files[:number]
    if not number or problem.file == file.name or problem.sentence or problem.value is None:
        return problem
    brought = _brought(
        file.tree, lambda tree: problem.key in wrong_keys([*below, replace(file, tree=tree)])
    )
    if brought is None:
        return problem
    where = replace(problem, key=f"{problem.key} of {problem.file}")
    return Problem(*brought, fitting(where), file.name)


def _brought(tree: Tree, brings: Callable[[Tree], bool]) -> tuple[str, Any] | None:
    """The deepest key, with its value, that brings a misfit by itself."""
    for name, value in tree.items():
        if brings({name: value}):
            # what has a kind, or a value and its unit, is one
            if isinstance(value, dict) and not {"kind", "value"} & set(value):
                inner = _brought(value, partial(_within, brings, name))
                if inner is not None:
                    return f"{name}.{inner[0]}", inner[1]
            return name, value
    return None


def _within(brings: Callable[[Tree], bool], section: str, tree: Tree) -> bool:
    return brings({section: tree})


def fitting(problem: Problem) -> str:
    """What is valid where a value brings the misfit of another key."""
    return f"one with which {problem.key}, here {problem.value}, is {problem.valid}"


def lies_in(key: str, above: str) -> bool:
    """Whether a key is another one or lies below it."""
    return f"{key}.".startswith(f"{above}.")
