"""A first study by ``sandmould new``: asked for, or stated by options."""

from __future__ import annotations

from pathlib import Path

import pytest
import yaml
from typer.testing import CliRunner

from sandmould.cli.commands import app
from sandmould.study.new_study import WHY_HELD, NewStudy, applies, write_new_study
from sandmould.study.plan.build_plan import open_plan


@pytest.fixture(autouse=True)
def _elsewhere(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)


@pytest.mark.parametrize("cavity", ["tube", "hole_up", "hole_down", "none"])
def test_each_drive_with_each_cavity_plans(cavity: str) -> None:
    for hold in ("acceleration", "velocity", "displacement", "unbalance"):
        for engine in (
            ("reference", "lammps") if applies("engine", hold, cavity) else ("reference",)
        ):
            path = Path(f"{hold}_{engine}.yaml")
            answers = {"hold": hold, "cavity": cavity, "engine": engine}
            plan = write_new_study(path, NewStudy.model_validate(answers))
            assert len(plan.runs) == 16
            scenario = plan.runs[0].scenario
            assert scenario.vibration[0].hold == hold
            assert [c.name for c in scenario.cavities] == ["hole"] * cavity.startswith("hole")


def test_options_answer_without_a_terminal() -> None:
    options = ["--hold", "displacement", "--displacement-m", "0.0002", "--settings", "3"]
    options += ["--lowest-hz", "20", "--highest-hz", "80", "--wave-speed-m-s", "130"]
    said = CliRunner().invoke(app, ["new", "mine.yaml", "--yes", *options])
    assert said.exit_code == 0, said.output
    assert said.output.startswith("mine.yaml: 12 runs\n")
    told = yaml.safe_load(Path("mine.yaml").read_text())
    assert told["sweep"]["keys"] == {"vibration.0.frequency_hz": [20, 40, 80]}
    assert told["scenario"]["contact"] == {"wave_speed_m_s": 130}
    said = CliRunner().invoke(app, ["new", "mine.yaml", "--yes"])
    assert (said.exit_code, said.stderr) == (
        1, "FILE = 'mine.yaml' cannot be used: valid is a new file, or --overwrite beside it.\n"
    )  # fmt: skip
    assert CliRunner().invoke(app, ["new", "mine.yaml", "--yes", "--overwrite"]).exit_code == 0
    assert len(open_plan(Path("mine.yaml")).runs) == 16


def test_it_asks_what_is_held_first_and_asks_again_what_cannot_be_used() -> None:
    typed = ["none held", "velocity", "fast", "0.05", *[""] * 20]
    said = CliRunner().invoke(app, ["new"], input="\n".join(typed))
    assert said.exit_code == 0, said.output
    assert said.output.startswith(WHY_HELD)
    assert "Error: valid is one of 'acceleration', 'velocity'" in said.output
    assert "Error: valid is a number" in said.output
    assert "Rotating mass" not in said.output
    told = yaml.safe_load(Path("my_study.yaml").read_text())
    assert told["scenario"]["vibration"][0]["velocity_m_s"] == 0.05


@pytest.mark.parametrize(
    ("options", "sentence"),
    [
        (["--velocity-m-s", "1"], "leave --velocity-m-s out with --hold acceleration."),
        (["--opening-m", "1", "--cavity", "none"], "leave --opening-m out with --cavity none."),
        (["--settings", "1"], "--settings = 1 cannot be used: valid is a number"),
        (["--lowest-hz", "200"], "--lowest-hz = 200.0 cannot be used: valid is less than"),
        (["--opening-m", "0.001"], "scenario.obstacles.0.diameter_m = 0.001 cannot be used"),
    ],
)
def test_what_cannot_be_used_is_one_sentence(options: list[str], sentence: str) -> None:
    said = CliRunner().invoke(app, ["new", "--yes", *options])
    assert said.exit_code == 1
    assert sentence in said.stderr
    assert len(said.stderr.splitlines()) == 1
