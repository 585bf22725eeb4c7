"""Class names that mean more than one thing: ``python -m benchmarks.house.names``, part of lint."""

from __future__ import annotations

import ast
from collections.abc import Sequence
from pathlib import Path

from sandmould import ROOT
from sandmould.module_main import run_main

FOLDERS = ("sandmould", "analysis", "pattern_fe", "benchmarks")
OTHERS_IDIOMS = ("benchmarks/peers/sweep",)
"""Written as users of other tools write."""


def doubled_names(
    root: Path, folders: Sequence[str] = FOLDERS, without: Sequence[str] = OTHERS_IDIOMS
) -> dict[str, list[str]]:
    """Find top-level classes that are defined more than once.

    Parameters
    ----------
    root : Path
        The repository.
    folders : sequence of str
        Where to look, as seen from there.
    without : sequence of str
        Folders that are left out.

    Returns
    -------
    dict of str to list of str
        Place of each definition, such as ``sandmould/runs/cost.py:12``, by name; both sorted.

    Raises
    ------
    SyntaxError
        When a file is no Python.
    """
    places: dict[str, list[str]] = {}
    for folder in folders:
        for path in sorted((root / folder).rglob("*.py")):
            name = path.relative_to(root).as_posix()
            if any(name.startswith(f"{part}/") for part in without):
                continue
            for node in ast.parse(path.read_text(encoding="utf-8"), name).body:
                if isinstance(node, ast.ClassDef):
                    places.setdefault(node.name, []).append(f"{name}:{node.lineno}")
    return {name: defined for name, defined in sorted(places.items()) if len(defined) > 1}


def main(root: Path = ROOT) -> int:
    """Print the doubled names; status 1 where there is any."""
    doubled = doubled_names(root)
    for name, places in doubled.items():
        print(f"{name} is {len(places)} classes: {', '.join(places)}")
    return 1 if doubled else 0


if __name__ == "__main__":
    run_main(main, "python -m benchmarks.house.names")
