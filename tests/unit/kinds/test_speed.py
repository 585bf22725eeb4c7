"""The speed of an engine on this machine."""

from __future__ import annotations

import subprocess
import sys
import time
from pathlib import Path
from typing import Any

import pytest
import yaml
from typer.testing import CliRunner

from sandmould import ROOT
from sandmould.cli.commands import app
from sandmould.engines.session import Session
from sandmould.kinds.kind import StoredSpeed
from sandmould.kinds.registry import kind_of
from sandmould.kinds.sand.speed import SandSpeed, _spent_s, _window_rate
from sandmould.study.plan.expand import expand
from sandmould.study.plan.load_study import open_study
from tests.liggghts_scenes import needs_liggghts
from tests.scenes import TUBE_SCENE, tube_scene

pytestmark = pytest.mark.usefixtures("unmeasured")


class OnABusyMachine:
    """A session whose engine has a core for a small part of the time."""

    steps, grains = 0, 10

    def advance(self) -> None:
        begun_s = time.process_time()
        while time.process_time() - begun_s < 2e-3:
            pass
        time.sleep(0.01)
        self.steps += 100


def test_time_in_which_others_have_the_cores_does_not_count() -> None:
    rate = _window_rate(OnABusyMachine())  # type: ignore[arg-type]
    assert 0.5 < rate / (10 * 100 / 2e-3) <= 1.0  # by the clock it would be below 0.17


def test_an_engine_in_a_process_of_its_own_counts() -> None:
    begun_s = _spent_s()
    with subprocess.Popen([sys.executable, "-c", "while True: pass"]) as engine:
        while _spent_s() - begun_s < 0.2:
            time.sleep(0.01)
            assert engine.poll() is None
        engine.kill()


@pytest.mark.slow
def test_sand_that_settles_is_timed_while_it_does(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Each window has work, though a layer ends by itself after 2 s, before the last of them."""
    windows: list[float] = []

    def noted(session: Session) -> float:
        windows.append(_window_rate(session))
        return windows[-1]

    monkeypatch.setattr("sandmould.kinds.sand.speed._window_rate", noted)
    monkeypatch.setattr("sandmould.kinds.sand.speed.WINDOWS", 16)
    coarse = {"sand": {"disc_thickness_m": 0.1}, "time_step": {"fraction": 0.8}}
    scene = tube_scene(engine={"name": "reference"}, vibration=[], **coarse)
    rate = SandSpeed().trial(scene, tmp_path)
    assert rate is not None
    assert 0.0 < min(windows) <= rate <= max(windows)


SCENES: dict[str, dict[str, Any]] = {
    "pattern": {
        "pattern": {
            "shape": {"kind": "bar", "width_m": 0.02, "height_m": 0.01},
            "position_m": [0.0, 0.02],
            "supports": {"clamped": ["left"]},
            "loop": {"scheme": "fixed", "factor": 0.02, "repeats": 0},
        }
    },
    "obstacle": {
        "obstacles": [
            {"kind": "plate", "name": "gate", "centre_m": [0.06, 0.03], "size_m": [0.04, 0.01]}
        ],
        "discharge": {"gate": "gate"},
    },
    "cavity": {
        "cavities": [
            {"kind": "box", "name": "nook", "centre_m": [0.01, 0.01], "size_m": [0.02, 0.02]}
        ]
    },
}


@pytest.mark.parametrize("scene", SCENES)
@pytest.mark.parametrize(
    "engine", ["lammps", "reference", pytest.param("liggghts", marks=needs_liggghts)]
)
def test_each_engine_prices_each_scene_in_an_empty_folder(
    engine: str, scene: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """The trial leaves parts of the scene away; what goes with them must go too."""
    monkeypatch.chdir(tmp_path)
    for name, value in {"WINDOWS": 1, "WINDOW_S": 1e-3, "FALL_WALL_S": 0.0}.items():
        monkeypatch.setattr(f"sandmould.kinds.sand.speed.{name}", value)
    bed = {"obstacles": [], "background_damping": {"form": "none"}}
    sand = {**TUBE_SCENE["sand"], "disc_inertia": "sphere"}
    scenario = {**TUBE_SCENE, **bed, "sand": sand, **SCENES[scene], "engine": {"name": engine}}
    objective = {"measure": "solid_fraction", "better": "neither"}
    tree = {"material": "rojek_2004", "scenario": scenario, "objective": objective}
    Path("priced.yaml").write_text(yaml.safe_dump(tree))
    ran = CliRunner().invoke(app, ["plan", "priced.yaml"])
    assert ran.exit_code == 0, ran.output
    assert "at the speed measured on this machine" in ran.stdout


@pytest.mark.parametrize("name", ["plates_small", "bracket_freezes", "tank_small", "shoulder_pour"])
def test_castings_are_priced_by_a_trial_on_this_machine(name: str, tmp_path: Path) -> None:
    scenario = expand(open_study(ROOT / "config" / "studies" / f"{name}.yaml"))[0].scenario
    speed = kind_of(scenario).planning.speed
    assert speed.stored(scenario) is None
    rate = speed.measured(scenario, tmp_path)
    # within a hundred times the speed of a core of 2026
    assert 1e4 < rate < 5e10
    assert speed.stored(scenario) == rate


def test_a_speed_is_measured_once_and_a_damaged_file_is_written_anew(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    trials: list[str] = []

    class Speed(StoredSpeed[Any]):
        def computed_by(self, scenario: str) -> str:
            return scenario

        def trial(self, scenario: str, results: Path) -> float | None:
            trials.append(scenario)
            return None if scenario == "fails" else 2.0

    speed = Speed()
    assert speed.measured("fails", tmp_path) is None
    assert not speed.file("fails").exists()
    for _ in range(2):
        assert speed.measured("one", tmp_path) == 2.0
    assert speed.measured("another", tmp_path) == 2.0
    assert trials == ["fails", "one", "another"]
    assert speed.stored("one") == 2.0
    for damage in (b"", b"[1]", b"\xff", b"nan", b"-1", b"0"):
        speed.file("one").write_bytes(damage)
        assert speed.stored("one") is None
        assert speed.measured("one", tmp_path) == 2.0
        assert speed.stored("one") == 2.0
    monkeypatch.setenv("XDG_CACHE_HOME", "/proc")  # where nothing can be written
    assert speed.measured("one", tmp_path) == 2.0
    assert speed.stored("one") is None
