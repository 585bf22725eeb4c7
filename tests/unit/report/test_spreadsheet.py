"""The spreadsheet of a study, opened again: its numbers, units and texts."""

from __future__ import annotations

from pathlib import Path

import pandas as pd
import pytest
from openpyxl import load_workbook

from sandmould.report.spreadsheet import _shown, write_spreadsheet
from sandmould.runs.formatting import is_number
from sandmould.statistics.verdict import compare_settings
from sandmould.study.collect import collect
from tests.unit.report_study import PLANTED, write_study

AMPLITUDE_M = 0.000596


def sheets(study: Path) -> dict[str, pd.DataFrame]:
    collect(study)
    summary = pd.read_csv(study / "summary.tsv", sep="\t")
    summary["drive_displacement_m"] = AMPLITUDE_M
    summary["probe_k"] = 373.15
    summary["detail"] = "=1+1"
    summary["hole_fill_of_bed_fraction"] = 0.25
    summary.to_csv(study / "summary.tsv", sep="\t", index=False)
    write_spreadsheet(study, study / "report.xlsx")
    book = load_workbook(study / "report.xlsx")
    tables = {}
    for sheet in book.worksheets:
        heads, *rows = sheet.iter_rows(values_only=True)
        tables[sheet.title] = pd.DataFrame(rows, columns=heads)
        assert not any(cell.data_type == "f" for row in sheet.iter_rows() for cell in row)
    return tables


def test_settings_and_runs_are_read_again_in_units_of_a_foundry(tmp_path: Path) -> None:
    study = write_study(tmp_path / "tube")
    tables = sheets(study)
    summary = pd.read_csv(study / "summary.tsv", sep="\t")
    verdict = compare_settings(summary, ["vibration.0.frequency_hz"], "tube_fill_fraction")
    settings = tables["settings"]
    hole = "fill of the hole as a share of what fits"
    assert list(settings.columns) == [
        "frequency, Hz", "amplitude of the box, mm", "mean fill of the tube",
        "fill of the tube, 95 % from", "fill of the tube, 95 % to", f"mean {hole}",
        f"{hole}, 95 % from", f"{hole}, 95 % to", "runs", "planned",
    ]  # fmt: skip
    assert list(settings["frequency, Hz"]) == sorted(PLANTED)
    # twelve digits are written
    assert list(settings["amplitude of the box, mm"]) == pytest.approx([0.596] * 3, rel=1e-11)
    for row, setting in zip(settings.to_numpy(), verdict.settings, strict=True):
        reach = setting.ci_half_width
        ends = [setting.mean - reach, setting.mean + reach]
        assert list(row[2:5]) == pytest.approx([setting.mean, *ends], rel=1e-11)
        assert row[5] == 0.25
        assert list(row[8:]) == [setting.n, setting.planned]
    runs = tables["runs"]
    assert list(runs["run"]) == list(summary["run"])
    assert list(runs["probe, °C"]) == pytest.approx([100.0] * len(summary), abs=1e-9)
    assert list(runs["detail"]) == ["=1+1"] * len(summary)
    fills = runs["fill of the tube"].astype(float)
    assert fills.to_numpy() == pytest.approx(
        summary["tube_fill_fraction"].to_numpy(), rel=1e-11, nan_ok=True
    )


@pytest.mark.parametrize(
    ("key", "value", "shown"),
    [
        ("depth_m", 0.012, 12.0), ("drive_velocity_m_s", 0.187, 187.0), ("void_m3", 1e-9, 1.0),
        ("wall_s", 3.0, 3.0), ("outcome", "finished", "finished"), ("part_k", 273.15, 0.0),
    ],
)  # fmt: skip
def test_units(key: str, value: object, shown: object) -> None:
    got = _shown(key, value)
    assert got == (pytest.approx(shown) if is_number(shown) else shown)
