"""What the plan says of the table's motion, and of spaces that are narrow for the grains."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import yaml

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
    first = lines.index("What the settings ask of the table:")
    assert lines[first + 1].split() == ["frequency", "amplitude*", "velocity", "acceleration"]
    assert lines[first + 3].split() == ["50", "Hz", "0.149", "mm", "46.8", "mm/s", "1.50", "g"]
    assert "* half of peak to peak" in lines[first + 4]
    assert "Below 1 g the box never throws the sand: expect little." in lines[first + 5]
    (rule,) = [line for line in lines if line.startswith("Frequency: ")]
    assert "Expect good filling from about 85 Hz on: 0.25 c/(4 H) at this wave speed." in rule
    assert rule.endswith("docs/frequency_law.md.")


def test_twelve_settings_are_listed_and_the_rest_counted(tmp_path: Path) -> None:
    plan = plan_of(tmp_path, [float(n) for n in range(1, 16)])
    assert "and 3 more" in plan
    assert "Below 1 g" not in plan


def test_a_sideways_shake_has_no_rule_of_frequency_and_throws_nothing(tmp_path: Path) -> None:
    sideways = [{"frequency_hz": 50, "acceleration_g": 1.5, "direction": "horizontal"}]
    plan = plan_of(tmp_path, [0.5, 1.5], vibration=sideways)
    assert "Frequency: " not in plan
    assert "Below 1 g" not in plan


def test_a_space_narrower_than_five_grains_is_told_with_its_numbers(tmp_path: Path) -> None:
    assert "can jam" not in plan_of(tmp_path, [1.5], sand={"size_scale": 4})
    (note,) = [
        line for line in plan_of(tmp_path, [1.5], sand={"size_scale": 24}).splitlines()
        if "can jam" in line
    ]  # fmt: skip
    assert note.startswith("Note: tube is as narrow as 24 mm: 1.0 times the largest ")
    assert note.endswith("grain (23.2 mm). Below 5 times the grains can jam. Smaller grains "
                         "(sand.size_scale) tell more.")  # fmt: skip
