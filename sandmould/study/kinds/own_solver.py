"""What studies of casting have in common: our own solvers, which are given a whole scenario."""

from __future__ import annotations

import os
from collections.abc import Mapping
from pathlib import Path
from typing import TYPE_CHECKING, Any

from sandmould.scenario.bad_input import Problem
from sandmould.scenario.quantity import Section

if TYPE_CHECKING:
    from sandmould.study.expand import Run


def defaults() -> dict[str, Any]:
    """Nothing: what is cast is the user's."""
    return {}


def lasts_s(scenario: Section) -> float:
    """Measures are those of the end."""
    return 0.0


def engine_problem(scenario: Section) -> Problem | None:
    """None: the solver is our own."""
    return None


def ranks(scenario: Section) -> int:
    """No MPI."""
    return 1


def write_given(run: Run, folder: Path, solver: str) -> None:
    """Write every value of a run's scenario with its source to ``deck.in``.

    Parameters
    ----------
    run : Run
    folder : Path
    solver : str
        Hash of the solver's files.
    """
    lines = [
        f"# Study {run.study}, run {run.run}: what the solver {solver} is given",
        *_lines(run.scenario.model_dump(mode="json"), run.sources),
    ]
    partial = folder / "deck.in.partial"
    partial.write_text("\n".join(lines) + "\n", encoding="utf-8")
    os.replace(partial, folder / "deck.in")


def _lines(tree: Any, sources: Mapping[str, str], key: str = "") -> list[str]:
    """One line a value; a list with one source stays together."""
    if key in sources or not isinstance(tree, dict | list):
        return [f"{key} = {tree}".ljust(60) + f" # {sources.get(key, 'not stated')}"]
    each = tree.items() if isinstance(tree, dict) else enumerate(tree)
    return [line for n, v in each for line in _lines(v, sources, f"{key}.{n}" if key else str(n))]
