"""A first study by ``sandmould new``: asked for, or stated by options."""

from __future__ import annotations

from pathlib import Path

import pytest
import yaml
from typer.testing import CliRunner

from sandmould.bad_input import BadInputError
from sandmould.cli.commands import app
from sandmould.reference.new_answers import (
    WHY_HELD,
    NewStudy,
    applies,
    engines,
    finer_scale,
    number_in,
    remarks,
)
from sandmould.reference.new_study import write_new_study
from sandmould.scenario.placement import plan_counts, predicted_bed_height_m
from sandmould.study.plan.build_plan import open_plan


@pytest.fixture(autouse=True)
def _elsewhere(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)


@pytest.mark.parametrize("cavity", ["tube", "hole_up", "hole_down", "none"])
def test_each_drive_with_each_cavity_plans(cavity: str) -> None:
    for hold in ("acceleration", "velocity", "displacement", "unbalance"):
        for engine in engines() if applies("engine", hold, cavity) else ["reference"]:
            path = Path(f"{hold}_{engine}.yaml")
            answers = {"hold": hold, "cavity": cavity, "engine": engine}
            found = NewStudy.model_validate(answers | {"sand_height_mm": 95.0})
            plan = write_new_study(path, found)
            assert len(plan.runs) == 16
            scenario = plan.runs[0].scenario
            assert scenario.vibration[0].hold == hold
            level_m = predicted_bed_height_m(scenario, plan_counts(scenario))
            assert level_m == pytest.approx(0.095, rel=0.005)
            assert [c.name for c in scenario.cavities] == ["hole"] * cavity.startswith("hole")


@pytest.mark.parametrize(
    ("cavity", "size", "middle_mm"),
    [
        ("tube", {"opening_mm": 80.0}, 43.0),
        ("hole_up", {"cavity_depth_mm": 45.0}, 25.5),
        ("hole_down", {"cavity_depth_mm": 80.0}, 67.0),
    ],
)
def test_a_large_hole_is_put_where_it_fits(
    cavity: str, size: dict[str, float], middle_mm: float
) -> None:
    found = NewStudy.model_validate({"cavity": cavity} | size)
    assert found.middle_mm == middle_mm
    low_mm, high_mm = found.solid_ends_mm
    assert (low_mm >= 0.0, high_mm <= found.height_mm) == (True, True)


def test_options_answer_without_a_terminal() -> None:
    options = ["--hold", "displacement", "--amplitude-mm", "0.0002 m", "--settings", "3"]
    options += ["--lowest-hz", "20", "--highest-hz", "80", "--wave-speed-m-s", "130"]
    said = CliRunner().invoke(app, ["new", "mine.yaml", "--yes", *options])
    assert said.exit_code == 0, said.output
    assert said.output.startswith("mine.yaml: 12 runs\n")
    told = yaml.safe_load(Path("mine.yaml").read_text())
    assert told["scenario"]["vibration"][0]["displacement_m"] == 0.0002
    assert told["sweep"]["keys"] == {"vibration.0.frequency_hz": [20, 40, 80]}
    assert told["scenario"]["contact"] == {"wave_speed_m_s": 130}
    said = CliRunner().invoke(app, ["new", "mine.yaml", "--yes"])
    assert (said.exit_code, said.stderr) == (
        1, "FILE = 'mine.yaml' cannot be used: valid is a new file, or --overwrite beside it.\n"
    )  # fmt: skip
    assert CliRunner().invoke(app, ["new", "mine.yaml", "--yes", "--overwrite"]).exit_code == 0
    assert len(open_plan(Path("mine.yaml")).runs) == 16


def test_it_asks_what_is_held_first_and_asks_again_what_cannot_be_used() -> None:
    typed = ["none held", "velocity", "fast", "0.05 m/s", "", "10", "", "", "horizontal"]
    typed += ["0.001", *[""] * 6, "500", "", "100", "", "", "no_sand", "", "100", *[""] * 6]
    said = CliRunner().invoke(app, ["new"], input="\n".join(typed))
    assert said.exit_code == 0, said.output
    assert said.output.startswith(WHY_HELD)
    assert "Error: valid is one of 'acceleration', 'velocity'" in said.output
    assert "Error: valid is a number in mm/s or with its unit" in said.output
    assert "Error: valid is more than the lowest frequency, 25 Hz" in said.output
    assert "g, so that two settings are left" in said.output
    assert "Error: valid is less than 120 mm" in said.output
    assert "Error: valid is from 15 to 95 mm, so that hole and walls lie in the box" in said.output
    assert "Error: valid is one of rojek_2004" in said.output
    assert "the largest grain must be smaller than the hole" in said.output
    assert "Rotating mass" not in said.output
    told = yaml.safe_load(Path("my_study.yaml").read_text())
    stage = told["scenario"]["vibration"][0]
    assert (stage["velocity_m_s"], stage["direction"]) == (0.05, "horizontal")


@pytest.mark.parametrize(
    ("options", "sentence"),
    [
        (["--velocity-mm-s", "1"], "leave --velocity-mm-s out with --hold acceleration."),
        (["--opening-mm", "1", "--cavity", "none"], "leave --opening-mm out with --cavity none."),
        (["--settings", "1"], "--settings = 1 cannot be used: valid is a number"),
        (["--lowest-hz", "200"], "--highest-hz (its default) = 140.0 cannot be used: valid is"),
        (["--opening-mm", "1"], "--size-scale (its default) = 6.0 cannot be used: valid is less"),
        (["--amplitude-mm", "150", "--hold", "displacement"], "valid is a number of at most 100"),
        (["--cavity-depth-mm", "0.2 m"], "valid is less than 120 mm, so that it lies in the box"),
        (["--engine", "liggghts"], "--engine = 'liggghts' cannot be used: valid is one of "),
        (["--width-mm", "0.2 km"], "valid is a number in mm or with its unit"),
    ],
)
def test_what_cannot_be_used_is_one_sentence(options: list[str], sentence: str) -> None:
    said = CliRunner().invoke(app, ["new", "--yes", *options])
    assert said.exit_code == 1
    assert sentence in said.stderr
    assert len(said.stderr.splitlines()) == 1
    assert not Path("my_study.yaml").exists()


def test_a_file_that_does_not_plan_is_not_left_behind() -> None:
    # the time step is too long for such a frequency, which the whole file alone tells
    answers = {"lowest_hz": 9_000.0, "highest_hz": 10_000.0, "size_scale": 18.0}
    Path("mine.yaml").write_text("before")
    for name in ("mine.yaml", "new.yaml"):
        with pytest.raises(BadInputError):
            write_new_study(Path(name), NewStudy.model_validate(answers))
    assert Path("mine.yaml").read_text() == "before"
    assert not Path("new.yaml").exists()


def test_settings_above_what_the_table_bears_are_left_out_and_idle_ones_named() -> None:
    # 0.25 mm: (2 pi f)^2 0.25 mm / g is 0.63 g at 25 Hz, 6.2 g at 78.8 Hz, 19.7 g at 140 Hz
    answers = {"hold": "displacement", "amplitude_mm": 0.25, "most_g": 10.0}
    found = NewStudy.model_validate(answers)
    assert [s.frequency_hz for s in found.borne] == [25.0, 44.4, 78.8]
    said = remarks(found)
    assert said[1].split() == [
        *("25", "0.25", "39.3", "0.629"),
        *["moves", "nothing:", "below", "1", "g"],
    ]
    assert "moves" not in said[2]
    assert "Left out: 140 Hz, 19.7 g; the table bears 10 g." in said


@pytest.mark.parametrize(
    ("text", "unit", "value"),
    [("0.25", "mm", 0.25), ("0.00025 m", "mm", 0.25), ("2cm", "mm", 20.0),
     ("0.05 m/s", "mm/s", 50.0), ("50 Hz", "Hz", 50.0), ("1e2 mm", "mm", 100.0)],
)  # fmt: skip
def test_a_length_may_have_its_unit(text: str, unit: str, value: float) -> None:
    assert number_in(text, unit) == value


def test_a_hole_of_few_grains_is_warned_of_with_a_scale_that_mends_it() -> None:
    found = NewStudy.model_validate({"opening_mm": 25.0})
    finer = finer_scale(found)
    assert finer is not None
    assert any(f"--size-scale {finer:g} " in line for line in remarks(found))
    assert finer_scale(found.model_copy(update={"size_scale": finer})) is None
