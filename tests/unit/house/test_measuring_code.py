"""Runs are measured again when the code changes that measures: the list of it is whole."""

from __future__ import annotations

import ast
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest

from sandmould import ROOT
from sandmould.kinds.kind import Kind
from sandmould.kinds.registry import KINDS

HOUSES = ("sandmould.analysis.", "sandmould.kinds.")
COMPUTES = "sandmould.kinds.deck.own."
"""What renders and runs a deck of the user's own, whose log has the measures."""
DRAW_OR_DESCRIBE = (
    "plots", "casting_plots", "export", "bent_files", "kind", "measures",
)  # fmt: skip
"""Files that change no number of a measure."""


def imported(path: Path) -> Iterator[Path]:
    """Files of ours that a file imports, wherever in it."""
    for node in ast.walk(ast.parse(path.read_text(encoding="utf-8"))):
        names = [alias.name for alias in node.names] if isinstance(node, ast.Import) else []
        if isinstance(node, ast.ImportFrom) and node.module:
            names = [node.module, *(f"{node.module}.{alias.name}" for alias in node.names)]
        for name in names:
            file = ROOT / f"{name.replace('.', '/')}.py"
            if name.startswith(HOUSES) and not name.startswith(COMPUTES) and file.is_file():
                yield file


@pytest.mark.parametrize("kind", KINDS.values(), ids=lambda kind: kind.name)
def test_all_that_a_measure_is_made_with_is_listed(kind: Kind[Any]) -> None:
    listed = {ROOT / file for file in kind.planning.measuring}
    assert all(file.is_file() for file in listed)
    reached = set(listed)
    for file in listed:
        reached |= {each for each in imported(file) if each.stem not in DRAW_OR_DESCRIBE}
    assert reached == listed
