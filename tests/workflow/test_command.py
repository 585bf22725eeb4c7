"""The command ``sandmould`` computes and reports a study of seconds in an empty folder."""

from __future__ import annotations

import re
import subprocess
import sys
from pathlib import Path

import pandas as pd
import pytest
from typer.testing import CliRunner

from sandmould.cli.commands import app

COARSE = """\
based_on: plates
scenario: {heat_transfer_w_m2_k: null}
sweep:
  design: list
  points:
    - {exchange: corrected, element_m: 0.01, layers: []}
    - {exchange: faces, element_m: 0.01, layers: []}
reference: {exchange: corrected, element_m: 0.01}
"""


def test_a_study_from_an_empty_folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    Path("coarse.yaml").write_text(COARSE)
    command = [sys.executable, "-m", "sandmould.cli", "run", "coarse.yaml", "--cores", "2"]
    ran = subprocess.run(command, capture_output=True, text=True, timeout=120)
    assert ran.returncode == 0, ran.stderr
    results = Path("results", "coarse")
    said = (results / "verdict.txt").read_text().strip()
    assert said
    assert ran.stdout == f"{said} The report: results/coarse/report.html\n"
    *_, first, second, last = ran.stderr.splitlines()
    assert first.startswith("[1/2] ")
    assert second.startswith("[2/2] ")
    assert last.startswith("coarse: 2 of 2 runs done after ")
    assert not re.search("rule|jobid|Select jobs", ran.stderr)
    # The shipped profile lets two short runs share a job.
    assert len(list((results / "batches").glob("*.done"))) == 1
    summary = pd.read_csv(results / "summary.tsv", sep="\t")
    assert list(summary["outcome"]) == ["finished"] * 2
    assert {p.name for p in tmp_path.iterdir()} == {".snakemake", "coarse.yaml", "results"}

    said = CliRunner().invoke(app, ["status", "coarse.yaml"])
    assert said.stdout.startswith("coarse: 2 done of 2 runs\n")
    page = results / "report.html"
    page.unlink()
    again = CliRunner().invoke(app, ["report", "coarse.yaml"])
    assert again.exit_code == 0, again.output
    assert page.stat().st_size > 1e5
