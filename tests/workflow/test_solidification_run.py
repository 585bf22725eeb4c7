"""A tiny study of solidification through the workflow, as a user runs it."""

from __future__ import annotations

import subprocess
import sys
from pathlib import Path

import pandas as pd

from sandmould import ROOT

SNAKEMAKE = Path(sys.executable).parent / "snakemake"
TINY = """\
kind: solidification
material: hirata_2019
scenario:
  box: {low_m: [0, 0], high_m: [0.08, 0.08]}
  shapes: [{kind: rectangle, low_m: [0.03, 0.02], high_m: [0.05, 0.06]}]
  probes: [{name: middle, at_m: [0.04, 0.04]}]
  element_m: 0.005
  until_s: 400
sweep: {keys: {exchange: [faces, difference]}}
reference: {exchange: difference}
objective: {measure: solidification_time_s, better: neither}
equivalence: {keys: [exchange], margins: {solidification_time_s: 1}}
"""


def test_a_tiny_casting_solidifies_through_the_workflow(tmp_path: Path) -> None:
    for name in ("Snakefile", "workflow", "templates", "config", "profiles"):
        (tmp_path / name).symlink_to(ROOT / name)
    (tmp_path / "bar.yaml").write_text(TINY)
    command = [str(SNAKEMAKE), "--cores", "1", "--configfile", "bar.yaml"]
    ran = subprocess.run(command, cwd=tmp_path, capture_output=True, text=True, timeout=120)
    assert ran.returncode == 0, ran.stderr
    assert "2 runs" in ran.stderr
    assert "element-steps" in ran.stderr
    study = tmp_path / "results" / "bar"
    summary = pd.read_csv(study / "summary.tsv", sep="\t")
    assert summary["outcome"].tolist() == ["finished"] * 2
    faces_s, difference_s = summary["solidification_time_s"]
    # On one grid both have the same exchange; local steps change the time by less than a record.
    assert abs(faces_s - difference_s) < 5.0
    for run in summary["run"]:
        folder = study / "runs" / str(run)
        left = {path.name for path in folder.iterdir()}
        assert {"series.tsv", "fields.npz", "measures.tsv", "products.json", "deck.in"} <= left
    page = (study / "report.html").read_text()
    assert "last point to freeze" in page
    assert "Error and cost" in page
