"""What the plan says of the table's motion, and of spaces that are narrow for the grains."""

from __future__ import annotations

import math
from pathlib import Path
from typing import Any

import pytest
import yaml

from sandmould.kinds.sand.table_motion import best_by_records
from sandmould.study.plan.expand import expand
from sandmould.study.plan.load_study import open_study
from sandmould.study.plan.plan_files import plan_table
from sandmould.study.plan.price import Prices


def plan_of(folder: Path, values: list[float], **scenario: Any) -> str:
    study = {
        "based_on": "tube", "scenario": {"engine": {"name": "reference"}, **scenario},
        "sweep": {"keys": {"vibration.0.acceleration_g": values}},
    }  # fmt: skip
    path = folder / "trial.yaml"
    path.write_text(yaml.safe_dump(study), encoding="utf-8")
    return plan_table(expand(open_study(path)), Prices(), 1)


def test_the_plan_lists_what_the_table_must_do(tmp_path: Path) -> None:
    vibration = [{"frequency_hz": 50, "acceleration_g": 1.5}]
    lines = plan_of(tmp_path, [0.5, 1.5], vibration=vibration).splitlines()
    first = lines.index("Table motion:")
    assert lines[first + 1].split() == ["frequency", "amplitude*", "velocity", "acceleration"]
    assert lines[first + 3].split() == ["50", "Hz", "0.149", "mm", "46.8", "mm/s", "1.50", "g"]
    assert "* half of peak to peak" in lines[first + 4]
    assert "Below 1 g the box never throws the sand: expect little." in lines[first + 5]


def test_twelve_settings_are_listed_and_the_rest_counted(tmp_path: Path) -> None:
    plan = plan_of(tmp_path, [float(n) for n in range(1, 16)])
    assert "and 3 more" in plan
    assert "Below 1 g" not in plan


def test_a_sideways_shake_throws_nothing(tmp_path: Path) -> None:
    sideways = [{"frequency_hz": 50, "acceleration_g": 1.5, "direction": "horizontal"}]
    assert "Below 1 g" not in plan_of(tmp_path, [0.5, 1.5], vibration=sideways)


def test_half_the_gravity_is_left_at_half_the_acceleration(tmp_path: Path) -> None:
    vibration = [{"frequency_hz": 50, "acceleration_g": 1.5}]
    for gravity_m_s2, is_weak in ((9.81, True), (4.9, False)):
        plan = plan_of(tmp_path, [0.7], gravity_m_s2=gravity_m_s2, vibration=vibration)
        assert ("Below 1 g" in plan) is is_weak


def foretold(
    folder: Path, hold: str, values: list[float], duration_s: float = 2.0, **scenario: Any
) -> float:
    """Frequency that fills the shipped tube best by records."""
    amplitude = {
        "acceleration": {"acceleration_g": 1.5},
        "displacement": {"displacement_m": 1.5e-4},
    }
    stage = {"frequency_hz": 50, "duration_s": duration_s, "hold": hold, **amplitude[hold]}
    study = {
        "based_on": "tube", "scenario": {"vibration": [stage], **scenario},
        "sweep": {"keys": {"vibration.0.frequency_hz": values}},
    }  # fmt: skip
    path = folder / "trial.yaml"
    path.write_text(yaml.safe_dump(study), encoding="utf-8")
    return best_by_records([run.scenario for run in expand(open_study(path))])


def test_what_the_table_keeps_decides_which_frequency_is_foretold(tmp_path: Path) -> None:
    # c/(4 H) is 350 Hz: at 1.5 g the top lies near a quarter of it, or at the lowest frequency.
    assert foretold(tmp_path, "acceleration", [25, 42, 85, 150]) == 85
    assert foretold(tmp_path, "displacement", [50, 85, 150]) == 150
    hard = {"wave_speed_m_s": 256}
    assert foretold(tmp_path, "acceleration", [16, 60, 120], contact=hard) == 16
    plan = plan_table(expand(open_study(tmp_path / "trial.yaml")), Prices(), 1)
    assert "  By our records of such a tube 16 Hz should fill it best of these." in plan


WIDE = {"kind": "tube", "name": "tube", "diameter_m": 0.05, "length_m": 0.05, "left_end_x_m": 0.07,
        "wall_thickness_m": 0.003, "axis_height_m": 0.035, "closed_end": "right"}  # fmt: skip

ROOF = {"kind": "plate", "name": "roof", "centre_m": [0.03, 0.06], "size_m": [0.02, 0.003]}


@pytest.mark.parametrize(
    "beyond",
    [
        {"contact": {"wave_speed_m_s": 400}},
        {"fill": {"layers": [{"height_m": 0.1, "repeat": 5}]}, "box": {"height_m": 0.6}},
        {"obstacles": [WIDE]},
        {"obstacles": [WIDE | {"diameter_m": 0.024}, ROOF]},
        {"sand": {"size_scale": 9}},
        {"duration_s": 0.6},
    ],
)
def test_records_foretell_nothing_beyond_their_range(tmp_path: Path, beyond: Any) -> None:
    assert math.isfinite(foretold(tmp_path, "acceleration", [42, 85]))
    assert math.isnan(foretold(tmp_path, "acceleration", [42, 85], **beyond))
    assert math.isnan(foretold(tmp_path, "acceleration", [1000, 2000]))


def test_a_space_narrower_than_five_grains_is_told_with_its_numbers(tmp_path: Path) -> None:
    assert "may block" not in plan_of(tmp_path, [1.5], sand={"size_scale": 4})
    (note,) = [
        line for line in plan_of(tmp_path, [1.5], sand={"size_scale": 24}).splitlines()
        if "may block" in line
    ]  # fmt: skip
    assert note == (
        "Width of tube: tube is 24 mm wide, 1.0 times the largest grain (23.2 mm). Model grains "
        "may block it where real sand would not: use size_scale 4.9 or less."
    )
