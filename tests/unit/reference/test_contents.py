"""Finished studies leave no file, column or key that ``docs/files.md`` does not describe."""

from __future__ import annotations

from pathlib import Path

import pandas as pd
import pytest

from sandmould.reference.contents import OF_STUDY
from sandmould.report.page import write_report
from sandmould.runs.columns import OF_RUN
from tests.finished_study import FLOW, finished_study, study_text
from tests.undescribed import undescribed

SAND = """\
based_on: tube_quick
scenario:
  sand: {size_classes: 3}
  fill: {layers: [{count: 20}]}
  rest: {rms_speed_m_s: 10, load_tolerance: null, checks: 1}
  vibration: [{frequency_hz: 50, acceleration_g: 1.5, duration_s: 0.04}]
sweep: {keys: {vibration.0.frequency_hz: [50]}}
replicates: 1
"""
STUDIES = {"sand": SAND, "flow": FLOW, "casting": study_text((0.02,), ("faces",))}


@pytest.mark.slow
@pytest.mark.parametrize("kind", STUDIES)
def test_each_file_and_column_of_a_finished_study_is_described(
    kind: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    path = tmp_path / "finished.yaml"
    path.write_text(STUDIES[kind])
    plan = finished_study(path)
    folder = Path("results") / plan.study.name
    write_report(folder, folder / "report.html")
    assert undescribed(folder) == []
    # what is new is found: a file, a column of a table
    (run,) = (folder / "runs").iterdir()
    (run / "notes.txt").touch()
    table = pd.read_csv(run / "measures.tsv", sep="\t").assign(colour="red")
    table.to_csv(run / "measures.tsv", sep="\t", index=False)
    assert undescribed(folder) == ["measures.tsv: colour", "notes.txt"]


def test_names_that_own_measures_cannot_have_are_the_columns_of_the_tables() -> None:
    tables = [file for file in OF_STUDY if file.name in ("runs.tsv", "summary.tsv", "curves.tsv")]
    assert {c.name for file in tables for c in file.columns if "<" not in c.name} == OF_RUN
