"""Words of the sand sections: which run is pictured, and how the density changed."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pandas as pd
import pytest

from sandmould.engines.snapshot import Snapshot
from sandmould.report.curves import pictured_runs
from sandmould.report.sand import _role_text
from sandmould.runs.templates import worded
from sandmould.statistics.verdict import Verdict, compare_settings
from tests.snapshots import write_snapshots

FILL = "tube_fill_fraction"
ONE = np.ones(1)
STILL = Snapshot(0.1, np.nan, "settle_1", ONE.astype(int), ONE.astype(int), np.zeros((1, 2)),
                 np.zeros((1, 2)), np.zeros((1, 1)), ONE)  # fmt: skip


def _judged() -> tuple[Verdict, pd.DataFrame]:
    table = pd.DataFrame({"run": ["a", "b"], "f_hz": [25.0, 50.0], FILL: [0.3, 0.5],
                          "outcome_code": [0, 0]})  # fmt: skip
    return compare_settings(table, ["f_hz"], FILL), table


@pytest.mark.parametrize(
    ("role", "said"),
    [
        ("best", "the one with the highest fill of the tube of all single runs"),
        ("worst", "the one with the lowest fill of the tube of all single runs"),
        ("median", "the one in the middle by the fill of the tube of single runs"),
    ],
)
def test_a_pictured_run_is_told_by_its_value(role: str, said: str) -> None:
    verdict, table = _judged()
    assert _role_text(role, verdict, table) == said


def test_of_the_best_setting_the_run_in_the_middle_is_pictured(tmp_path: Path) -> None:
    fills = {"a": (25.0, 0.6), "b": (25.0, 0.1), "c": (50.0, 0.55), "d": (50.0, 0.5),
             "e": (50.0, 0.4)}  # fmt: skip
    table = pd.DataFrame(
        [{"run": run, "f_hz": f_hz, FILL: fill, "outcome_code": 0}
         for run, (f_hz, fill) in fills.items()]
    )  # fmt: skip
    for run in fills:
        write_snapshots(tmp_path / "runs" / run, [STILL])
    verdict = compare_settings(table, ["f_hz"], FILL)
    assert pictured_runs(tmp_path, table, verdict) == {"best": "d", "worst": "b"}
    assert _role_text("best", verdict, table) == (
        "one of those with the highest mean fill of the tube"
    )


@pytest.mark.parametrize(
    ("densities", "said"),
    [((1791.2, 1790.9), "stayed at 1\u202f791 kg"), ((1791.0, 1700.0), "fell from 1\u202f791 to")],
)
def test_a_density_that_shows_no_change_stayed(densities: tuple[float, float], said: str) -> None:
    assert said in worded("density_course.j2", kg_m3=densities)
