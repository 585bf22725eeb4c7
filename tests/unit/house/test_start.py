"""What a command loads before it can begin: a second of imports is a second that users wait."""

from __future__ import annotations

import os
import subprocess
import sys
from pathlib import Path

import pytest

from sandmould import ROOT

HEAVY = ("numba", "scipy", "pandas", "matplotlib", "jinja2", "skfem", "snakemake", "meshio")


def loaded(code: str, folder: Path) -> str:
    """Which of the heavy libraries some code loads in a Python of its own."""
    tell = f"import sys; print(sorted({{*{HEAVY!r}}} & {{*sys.modules}}))"
    ran = subprocess.run(
        [sys.executable, "-c", f"{code}\n{tell}"], cwd=folder, capture_output=True, text=True,
        check=True, env=os.environ | {"PYTHONPATH": str(ROOT)},
    )  # fmt: skip
    return ran.stdout.strip()


@pytest.mark.parametrize("engine", ["reference", "lammps"])
def test_a_sweep_of_sand_is_planned_without_what_computes_or_draws(
    engine: str, tmp_path: Path
) -> None:
    text = "based_on: tube\nscenario: {engine: {name: %s}}\n"
    text += "sweep: {keys: {vibration.0.frequency_hz: [20, 40]}}\n"
    (tmp_path / "trial.yaml").write_text(text % engine)
    code = (
        "from pathlib import Path\n"
        "import sandmould.execution.run_study, sandmould.execution.screen.screen\n"
        "from sandmould.study.plan.build_plan import checked_plan\n"
        "assert len(checked_plan(Path('trial.yaml')).runs) == 2"
    )
    assert loaded(code, tmp_path) == "[]"


def test_a_forked_snakemake_does_not_plan_again(tmp_path: Path) -> None:
    (tmp_path / "trial.yaml").write_text("based_on: tube\nsweep: {}\n")
    code = (
        "from pathlib import Path\n"
        "from sandmould.study.plan.build_plan import checked_plan, plan_at_hand\n"
        "first = plan_at_hand(Path('trial.yaml'))\n"
        "assert plan_at_hand(Path('trial.yaml').absolute()) is first\n"
        "last = checked_plan(Path('trial.yaml'))\n"
        "assert last is not first and plan_at_hand(Path('trial.yaml')) is last"
    )
    loaded(code, tmp_path)
