"""What a vibrating table can do: settings beyond it are left out, and nothing is asked beyond."""

from __future__ import annotations

import math
from pathlib import Path
from typing import Any

import pandas as pd
import pytest
import yaml

from sandmould.bad_input import BadInputError
from sandmould.definition.table import VibratingTable
from sandmould.report.page import _beyond_table
from sandmould.scenario.drive import BoxDrive
from sandmould.scenario.vibration import STANDARD_GRAVITY_M_S2
from sandmould.statistics.answer import Asked, Decided
from sandmould.statistics.decision import Evidence, decide
from sandmould.study.collect import Collected
from sandmould.study.plan.announcement import price
from sandmould.study.plan.build_plan import Plan, open_plan
from sandmould.wording.answer import limit_sentences
from sandmould.wording.next_steps import answer_steps
from tests.answered import FILL, HZ, SHARE, table

HELD_G = {"scenario": {"engine": {"name": "reference"}}, "sweep": {"keys": {HZ: [10, 25, 50, 90]}}}
"""Of the shipped tube at 1.5 g: 3.7, 0.60, 0.15 and 0.046 mm."""


def planned(folder: Path, **tree: Any) -> Plan:
    path = folder / "trial.yaml"
    path.write_text(yaml.safe_dump({"based_on": "tube", **HELD_G, **tree}), encoding="utf-8")
    return open_plan(path, results=folder)


def frequencies_hz(plan: Plan) -> list[float]:
    return sorted({run.parameters[HZ] for run in plan.runs})


@pytest.mark.parametrize(
    ("limits", "left"),
    [
        ({}, [10, 25, 50, 90]),
        ({"lowest_frequency_hz": 25, "highest_frequency_hz": 50}, [25, 50]),
        ({"largest_displacement_m": 0.0006}, [25, 50, 90]),
        ({"largest_velocity_m_s": 0.05}, [50, 90]),
        ({"largest_acceleration_g": 1.5}, [10, 25, 50, 90]),
    ],
)
def test_settings_beyond_the_table_are_left_out(
    tmp_path: Path, limits: dict[str, float], left: list[float]
) -> None:
    plan = planned(tmp_path, table=limits)
    assert frequencies_hz(plan) == left
    beyond = [hz for hz in (10, 25, 50, 90) if hz not in left]
    assert [point[HZ] for point in plan.beyond_table] == beyond
    said = price(plan, tmp_path, 1)
    assert ("Left out" in said) == bool(beyond)
    if "largest_displacement_m" in limits:
        assert "since your table cannot do it (largest displacement 0.6 mm): 10 Hz." in said


def test_the_report_names_what_the_table_cannot_do(tmp_path: Path) -> None:
    study = planned(tmp_path, table={"largest_displacement_m": 0.0006}).study.study
    # one of them is computed by another engine, too
    summary = pd.DataFrame({HZ: [25, 50, 90, 50], "engine.name": ["reference"] * 3 + ["lammps"]})
    collected = Collected(summary, pd.DataFrame(), (HZ, "engine.name"))
    (note,) = _beyond_table(study, study.scenario, collected)
    assert note.text.endswith("(largest displacement 0.6 mm): 10 Hz.")
    whole = Collected(pd.DataFrame({HZ: [10, 25, 50, 90]}), pd.DataFrame(), (HZ,))
    assert _beyond_table(study, study.scenario, whole) == ()


def test_a_vibration_during_the_fill_counts(tmp_path: Path) -> None:
    fill = {"vibration_between_layers": {"frequency_hz": 50, "acceleration_g": 3}}
    scenario = {**HELD_G["scenario"], "fill": fill}
    with pytest.raises(BadInputError, match="largest_acceleration_g = 2"):
        planned(tmp_path, scenario=scenario, table={"largest_acceleration_g": 2})


@pytest.mark.parametrize(
    ("tree", "said"),
    [
        ({"table": {"largest_displacement_m": 1e-5}}, "table.largest_displacement_m = 1e-05 "
         "does not allow 10 Hz: shake it less, or at another frequency."),
        ({"table": {"lowest_frequency_hz": 60, "highest_frequency_hz": 30}},
         "a lowest_frequency_hz of at most highest_frequency_hz"),
        ({"table": {"largest_displacement_m": 0.001},
          "cross_check": {"engine": "lammps", "at": {HZ: 10}},
          "equivalence": {"margins": {FILL: 0.03}}}, "does not allow 10 Hz: shake it less"),
    ],
)  # fmt: skip
def test_a_table_that_allows_nothing_is_refused(
    tmp_path: Path, tree: dict[str, Any], said: str
) -> None:
    with pytest.raises(BadInputError) as caught:
        planned(tmp_path, **tree)
    assert said in str(caught.value)


def test_a_setting_at_the_limit_is_within_it() -> None:
    """Conversions round: 1.5 g to an amplitude and back is not 1.5 in every digit."""
    amplitude_m = 1.5 * STANDARD_GRAVITY_M_S2 / (2 * math.pi * 47.0) ** 2
    limits = VibratingTable(highest_frequency_hz=47, largest_acceleration_g=1.5)
    assert limits.limit_beyond(BoxDrive(47.0, amplitude_m)) == ""
    assert limits.limit_beyond(BoxDrive(47.0, 1.001 * amplitude_m)) == "largest_acceleration_g"


def test_no_step_leads_beyond_the_table(tmp_path: Path) -> None:
    fills = {25: (0.30, 0.31, 0.32), 50: (0.40, 0.42, 0.41), 90: (0.60, 0.61, 0.63)}
    summary = table(HZ, **{FILL: fills, SHARE: fills})
    for limits, ends_there in (
        ({}, False),
        ({"highest_frequency_hz": 90}, True),
        ({"highest_frequency_hz": 95}, True),
        ({"highest_frequency_hz": 100}, False),
    ):
        study = planned(tmp_path, table=limits).study.study
        answer = decide(
            Asked(FILL, "larger", (HZ,)), Evidence(summary, table_limit_at=study.table_limit_at)
        )
        steps = " ".join(step.text for step in answer_steps(study, answer))
        assert ("above 90 Hz" in steps) != ends_there
        assert any("the table can do" in line for line in limit_sentences(answer)) == ends_there
        assert answer.decided is (Decided.BEST if ends_there else Decided.BEST_AT_END)
