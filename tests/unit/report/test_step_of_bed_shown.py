"""What a report says of time steps that were taken from filled beds."""

from __future__ import annotations

import pandas as pd

from sandmould.report.kinds.sand import _steps_above_limit
from sandmould.report.method import sand_method
from tests.scenes import tube_scene

SUMMARY = pd.DataFrame({
    "time_step_s": [2.1e-5, 2.4e-5, 2.2e-5],
    "bed_limit_s": [3.0e-5, 3.4e-5, 3.2e-5],
    "least_limit_s": [3.15e-5, 1.8e-5, None],
    "limit_moments": [20, 20, None],
})  # fmt: skip
"""Two runs that came to their vibration and one that did not."""


def time_step_row(summary: pd.DataFrame) -> str:
    scene = tube_scene(engine={"name": "reference"}, time_step={"bed_fraction": 0.7})
    rows = {row.about: row.text for row in sand_method(scene, [], summary)}
    return rows["Time step"]


def test_the_method_names_the_limits_beside_the_step() -> None:
    assert time_step_row(SUMMARY).endswith(
        ". After the fill, 2 runs take 0.700 to 0.706 of the exact limit of the filled bed, "
        "30 to 34 µs. The least limit of the shaken bed, over 20 moments of a run, is "
        "18 to 31.5 µs: 0.750 to 1.50 times the step"
    )


def test_runs_with_the_planned_step_have_no_such_limits() -> None:
    said = time_step_row(SUMMARY[["time_step_s"]])
    assert said.endswith("the critical step is set by the normal grain-grain contact")
    assert time_step_row(SUMMARY.iloc[2:]) == said


def test_runs_above_the_limit_are_counted() -> None:
    (said,) = _steps_above_limit(SUMMARY)
    assert said.startswith("In 1 of 3 runs the exact limit of the shaken bed fell below the time ")
    assert "to 0.750 of it at the least" in said
    assert _steps_above_limit(SUMMARY.iloc[[0, 2]]) == ()
    assert _steps_above_limit(SUMMARY[["time_step_s"]]) == ()
