"""What a type checker says of a script that uses the package: its face is typed."""

from __future__ import annotations

import ast
import inspect
import subprocess
import sys
from pathlib import Path

import pytest

import sandmould
from sandmould import ROOT

SCRIPT = """\
import sandmould

study = {"based_on": "tube_quick", "replicates": 2}
wall_s: float = sandmould.plan(study, name="mine").attrs["wall_time_s"]
result = sandmould.run(study, name="mine", quiet=True)
rows: int = len(result.summary)
runs: int = result.runs  # wrong: names
result.show(result.runs[0], time_s="late")  # wrong: a number is wanted
sandmould.plan(study, core=2)  # wrong: cores
result.sumary  # wrong: summary
sandmould.planned(study)  # wrong: there is no such name
"""


@pytest.mark.slow
def test_mypy_finds_the_errors_of_a_script(tmp_path: Path) -> None:
    script = tmp_path / "script.py"
    script.write_text(SCRIPT, encoding="utf-8")
    command = [sys.executable, "-m", "mypy", "--no-error-summary", str(script)]
    told = subprocess.run(command, cwd=ROOT, capture_output=True, text=True).stdout
    found = {int(line.split(":")[1]) for line in told.splitlines() if ": error: " in line}
    wrong = {n for n, line in enumerate(SCRIPT.splitlines(), 1) if "# wrong" in line}
    assert found == wrong, told


def test_what_checkers_read_is_what_is_there() -> None:
    stated = ast.parse((ROOT / "sandmould" / "__init__.pyi").read_text(encoding="utf-8"))
    names = [alias.name for node in stated.body if isinstance(node, ast.ImportFrom)
             for alias in node.names if node.module != "pathlib"]  # fmt: skip
    names += [node.target.id for node in stated.body if isinstance(node, ast.AnnAssign)]
    assert {*sandmould.__all__, "ROOT", "IS_CHECKOUT", "SHIPPED"} == set(names)
    for name in names:
        assert hasattr(sandmould, name)


def test_help_shows_signatures_and_docstrings() -> None:
    assert "cores: 'int | None' = None" in str(inspect.signature(sandmould.run))
    for each in (sandmould.run, sandmould.plan, sandmould.Result.grains):
        assert "Parameters" in (inspect.getdoc(each) or "")
