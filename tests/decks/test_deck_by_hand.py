"""A deck that a person runs alone gives what the session gives."""

from __future__ import annotations

import subprocess
import sys
from pathlib import Path
from typing import Any

import pytest
import yaml

from sandmould.engines.lammps.session import LammpsSession
from sandmould.engines.liggghts.process import executable
from sandmould.engines.liggghts.session import LiggghtsSession
from sandmould.engines.program import build_program
from sandmould.engines.registry import engine_of
from sandmould.scenario.scenario import Scenario
from tests.hopper import FLOOR_M, hopper_scene
from tests.liggghts_scenes import needs_liggghts, open_liggghts
from tests.scenes import open_lammps, tube_scene

LMP = str(Path(sys.executable).parent / "lmp")
GRAINS = 80
FILL = {"layers": [{"count": 40, "repeat": 2}]}
VIBRATED: dict[str, Any] = {
    "vibration": {"acceleration_g": 1.5, "frequency_hz": 50.0, "layer_s": 0.15}
}
SHORT: dict[str, Any] = {
    "fill": {"layers": [{"count": 15}, {"count": 65}]},
    "rest": {"rms_speed_m_s": 0.05, "discharge_rms_speed_m_s": 0.3, "load_tolerance": 0.1},
    "vibration": [{"acceleration_g": 1.5, "frequency_hz": 50.0, "duration_s": 0.02}],
}
"""Grains still roll where the flow counts as over: their places depend on every step before."""
TIMED = {"discharge": {"duration_s": 0.12}}


def run_by_hand(scenario: Scenario, folder: Path, command: str) -> dict[str, float]:
    """Run the deck alone and read the summary that it leaves."""
    program = build_program(scenario)
    engine_of(scenario).write_deck(program, {}, folder, "test", "test")
    ran = subprocess.run([command, "-in", "deck.in"], cwd=folder, capture_output=True, text=True)
    assert ran.returncode == 0, ran.stdout[-2000:]
    summary: dict[str, float] = yaml.safe_load((folder / "summary.yaml").read_text())
    assert summary["grains"] == GRAINS
    return summary


def run_through(session: LammpsSession | LiggghtsSession) -> None:
    """Take a session through all stages."""
    for stage in session._program.stages:
        if stage.layer:
            session.insert_layer(stage.layer)
        session.start_stage(stage)
        while not session.stage_over:
            session.advance()
        session.end_stage()


@pytest.mark.slow
@pytest.mark.parametrize(
    "scene",
    [
        tube_scene(frame="box", fill=FILL),
        tube_scene(frame="laboratory", fill=FILL),
        tube_scene(frame="box", fill=FILL | VIBRATED, vibration=[]),
        hopper_scene("lammps", **SHORT),
        hopper_scene("lammps", **SHORT | TIMED),
    ],
    ids=[
        "tube in the box frame",
        "tube in the laboratory frame",
        "vibrated fill",
        "hopper",
        "timed discharge",
    ],
)
def test_lammps_deck_equals_the_session(scene: Scenario, tmp_path: Path) -> None:
    summary = run_by_hand(scene, tmp_path / "hand", LMP)
    session = open_lammps(scene, tmp_path)
    run_through(session)
    assert session.steps == summary["steps"]
    if scene.discharge is not None:
        assert session.snapshot().position_m[:, 1].min() < FLOOR_M / 2  # sand has flowed out
    session.send("variable bed_top equal c_top")
    ours = {name: session._lmp.extract_variable(name) for name in ("rms_speed", "bed_top")}
    session.close()
    # A sum over all grains and a maximum, to the 15 digits that LAMMPS prints: grains of another
    # path would part by far more within a few collisions.
    assert ours["rms_speed"] == pytest.approx(summary["rms_speed_m_s"], rel=1e-14)
    assert ours["bed_top"] == pytest.approx(summary["largest_height_m"], rel=1e-14)
    assert (tmp_path / "hand" / "grains.dump").read_text().count("ITEM: TIMESTEP") > 2


@needs_liggghts
@pytest.mark.parametrize("changes", [SHORT, SHORT | TIMED], ids=["until it rests", "timed"])
def test_liggghts_deck_of_a_hopper_equals_the_session(
    changes: dict[str, Any], tmp_path: Path
) -> None:
    scene = hopper_scene("liggghts", **changes)
    summary = run_by_hand(scene, tmp_path / "hand", executable() or "liggghts")
    session = open_liggghts(scene, tmp_path)
    run_through(session)
    assert session.steps == summary["steps"]
    assert session.snapshot().position_m[:, 1].min() < FLOOR_M / 2
    top, speed = session.values(["c_top", "v_rms_speed"])
    session.close()
    assert top == summary["largest_height_m"]
    assert speed == summary["rms_speed_m_s"]
