"""Packed runs in an empty folder: the command computes the rest, and ends with the same study."""

from __future__ import annotations

import os
import shutil
import subprocess
import sys
from pathlib import Path

import pandas as pd
import pytest
from typer.testing import CliRunner

from sandmould.cli.commands import app
from sandmould.study.plan.build_plan import RESULTS
from tests.finished_study import finished_study, study_text

COMMAND = [sys.executable, "-m", "sandmould.cli", "run", "two.yaml", "--cores", "2"]
COST = ("wall_s", "cpu_s", "_per_s", "memory_bytes")
"""Ends of the columns that differ each time."""


def go_to(folder: Path, study: Path) -> Path:
    """Go to an empty folder with a study's file."""
    folder.mkdir()
    shutil.copy(study, folder)
    os.chdir(folder)
    return folder / RESULTS / "two"


def command(*arguments: str) -> str:
    ran = CliRunner().invoke(app, list(arguments))
    assert ran.exit_code == 0, ran.output
    return ran.output


def run() -> str:
    ran = subprocess.run(COMMAND, capture_output=True, text=True, timeout=300)
    assert ran.returncode == 0, ran.stdout + ran.stderr
    return ran.stderr


def times(results: Path) -> dict[str, int]:
    return {p.parent.name: p.stat().st_mtime_ns for p in results.glob("runs/*/outcome.json")}


def test_half_a_study_and_a_whole_one_go_on_elsewhere(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    study = tmp_path / "two.yaml"
    study.write_text(study_text([0.02], ["faces", "difference"]))
    undisturbed = finished_study(Path("two.yaml"))
    first, second = (tmp_path / RESULTS / "two" / "runs" / run.run for run in undisturbed.runs)
    second.rename(tmp_path / "aside")
    assert "two_runs.zip: 1 runs, " in command("pack", "two.yaml")
    (tmp_path / "aside").rename(second)

    # Half of it is there: the other half alone is computed.
    here = go_to(tmp_path / "here", study)
    assert command("unpack", "../two_runs.zip") == "two: 1 runs taken\n"
    taken = times(here)
    assert list(taken) == [first.name]
    run()
    assert times(here)[first.name] == taken[first.name]
    tables = [pd.read_csv(f / "summary.tsv", sep="\t") for f in (here, tmp_path / RESULTS / "two")]
    kept = [c for c in tables[0] if not c.endswith(COST)]
    pd.testing.assert_frame_equal(tables[0][kept], tables[1][kept])

    # All of it is there: nothing is computed, and report and tables are the same to the byte.
    command("pack", "two.yaml")
    there = go_to(tmp_path / "there", study)
    assert command("unpack", "../here/two_runs.zip") == "two: 2 runs taken\n"
    taken = times(there)
    said = run()
    assert "Compute" not in said
    assert times(there) == taken
    for name in ("summary.tsv", "curves.tsv", "agreement.tsv", "report.html"):
        assert (there / name).read_bytes() == (here / name).read_bytes(), name
    assert command("status", "two.yaml").startswith("two: 2 done of 2 runs\n")
