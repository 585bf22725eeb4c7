"""The command computes the best setting and the next with coarser grains, once they are known."""

from __future__ import annotations

import subprocess
import sys
from pathlib import Path

import pandas as pd
import pytest

STUDY = """
scenario:
  engine: {name: reference}
  box: {width_m: 0.06, height_m: 0.06}
  sand: {size_scale: 10, size_classes: 3}
  fill: {layers: [{height_m: 0.02}]}
  vibration: [{frequency_hz: 60, acceleration_g: 2, duration_s: 0.05}]
sweep: {keys: {vibration.0.acceleration_g: [1.5, 3, 6]}}
replicates: 3
objective: {measure: bed_solid_fraction}
grain_check: {price_share: 0.5}
"""


def run(*arguments: str) -> subprocess.CompletedProcess[str]:
    command = [sys.executable, "-m", "sandmould.cli", *arguments]
    return subprocess.run(command, capture_output=True, text=True, timeout=300)


def test_coarser_grains_are_computed_and_told(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    Path("packed.yaml").write_text(STUDY)
    ran = run("run", "packed.yaml", "--cores", "2")
    assert ran.returncode == 0, ran.stderr
    assert "Again with grains 1.5 times as large: " in ran.stderr
    checks = pd.read_csv("results/packed/summary_checks.tsv", sep="\t")
    assert set(checks["part"]) == {"control: grain_scale x1.5"}
    assert set(checks["outcome"]) == {"finished"}
    page = Path("results/packed/report.html").read_text(encoding="utf-8")
    assert 'id="grain-size"' in page
    assert "With grains 1.5 times finer the bed solid fraction at" in page
    # Nothing is chosen again, and nothing is left.
    again = run("run", "packed.yaml", "--cores", "2")
    assert "runs done, nothing left" in again.stderr
