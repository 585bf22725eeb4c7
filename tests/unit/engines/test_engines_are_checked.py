"""An engine that lacks part of its interface is found by the type checker, before it computes."""

from __future__ import annotations

import ast
import re
import shutil
import subprocess
import sys
from pathlib import Path

import pytest

from sandmould import ROOT

LEFT_OUT = {
    "lammps/engine.py": ["load_session"],
    "liggghts/engine.py": ["CAPABILITIES", "read_deck"],
    "liggghts/session.py": ["move_surface"],
    "reference/session.py": ["exact_limit_s", "set_state"],
}
"""Members by the file of an engine that they are taken out of."""
SAYS = (
    '"ModuleType" is missing following "EngineModule" protocol member: load_session',
    '"ModuleType" is missing following "EngineModule" protocol member: CAPABILITIES',
    '(got Module, expected "DeckReaderModule")',
    '"LiggghtsSession" is missing following "SandSession" protocol member: move_surface',
    '"ReferenceSession" is missing following "SandSession" protocol members: exact_limit_s, '
    "set_state",
    'Argument 1 to "assert_never" has incompatible type "Literal[\'fourth\']"',
)
"""Of each of them, and of an engine that the registry does not open."""


def leave_out(path: Path, name: str) -> None:
    """Take a function, a method or a constant out of a file."""
    text = path.read_text(encoding="utf-8")
    (found,) = (
        node
        for node in ast.walk(ast.parse(text))
        if (isinstance(node, ast.FunctionDef) and node.name == name)
        or (isinstance(node, ast.Assign) and ast.unparse(node.targets[0]) == name)
    )
    lines = text.splitlines()
    del lines[found.lineno - 1 : found.end_lineno]
    path.write_text("\n".join(lines) + "\n", encoding="utf-8")


@pytest.mark.slow
def test_a_missing_member_or_a_forgotten_engine_is_an_error_of_types(tmp_path: Path) -> None:
    house = tmp_path / "sandmould"
    shutil.copytree(ROOT / "sandmould", house, ignore=shutil.ignore_patterns("__pycache__"))
    for file, names in LEFT_OUT.items():
        for name in names:
            leave_out(house / "engines" / file, name)
    listed = house / "scenario" / "engine.py"
    text = listed.read_text(encoding="utf-8")
    listed.write_text(text.replace('"reference"]', '"reference", "fourth"]'), encoding="utf-8")
    cache = tmp_path / "cache"
    if (ROOT / ".mypy_cache").is_dir():  # what lint has left knows the libraries
        shutil.copytree(ROOT / ".mypy_cache", cache)
    settings = ["--config-file", ROOT / "pyproject.toml", "--cache-dir", cache]
    ran = subprocess.run(
        [sys.executable, "-m", "mypy", *settings, "-m", "sandmould.engines.registry"],
        cwd=tmp_path, capture_output=True, text=True, env={},
    )  # fmt: skip
    assert ran.returncode == 1, ran.stderr
    said = re.sub(r"\n\S+ note: +", " ", ran.stdout)
    assert [sentence for sentence in SAYS if sentence not in said] == [], said
