"""Decks of the hopper that a person runs give what the sessions give, over the opening too."""

from __future__ import annotations

import subprocess
import sys
from pathlib import Path

import pytest
import yaml

from sandmould.engines.choosing import engine_of
from sandmould.engines.lammps.session import LammpsSession
from sandmould.engines.liggghts.process import executable
from sandmould.engines.liggghts.session import LiggghtsSession
from sandmould.engines.program import Program, build_program
from tests.hopper import FLOOR_M, hopper_scene
from tests.liggghts_scenes import needs_liggghts, open_liggghts
from tests.scenes import open_lammps

LMP = str(Path(sys.executable).parent / "lmp")
SHORT = {
    "fill": {"layers": [{"count": 15}, {"count": 65}]},
    "discharge": {"settling": {"rms_speed_m_s": 0.3, "shortest_s": 0.1}},
    "vibration": [{"acceleration_g": 1.5, "frequency_hz": 50.0, "duration_s": 0.02}],
}
"""Grains still roll where the flow counts as over: their places depend on every step before."""


def run_by_hand(program: Program, folder: Path, command: str) -> dict[str, float]:
    """Run the deck alone and read the summary that it leaves."""
    engine_of(program.scenario).write_deck(program, {}, folder, "test", "test")
    ran = subprocess.run([command, "-in", "deck.in"], cwd=folder, capture_output=True, text=True)
    assert ran.returncode == 0, ran.stdout[-2000:]
    summary: dict[str, float] = yaml.safe_load((folder / "summary.yaml").read_text())
    assert summary["grains"] == 80
    return summary


def run_through(session: LammpsSession | LiggghtsSession, program: Program) -> None:
    """Take a session through all stages; sand falls out of the hopper."""
    for stage in program.stages:
        if stage.layer:
            session.insert_layer(stage.layer)
        session.start_stage(stage)
        while not session.stage_over:
            session.advance()
        session.end_stage()
    assert session.snapshot().position_m[:, 1].min() < FLOOR_M / 2


def test_lammps_deck_equals_the_session(tmp_path: Path) -> None:
    scene = hopper_scene("lammps", **SHORT)
    program = build_program(scene)
    summary = run_by_hand(program, tmp_path / "hand", LMP)
    session = open_lammps(scene, tmp_path)
    run_through(session, program)
    assert session.steps == summary["steps"]
    session.send("variable bed_top equal c_top")
    ours = {name: session._lmp.extract_variable(name) for name in ("rms_speed", "bed_top")}
    session.close()
    # The 15 digits that LAMMPS prints, as in test_deck_by_hand.py.
    assert ours["rms_speed"] == pytest.approx(summary["rms_speed_m_s"], rel=1e-14)
    assert ours["bed_top"] == pytest.approx(summary["largest_height_m"], rel=1e-14)


@needs_liggghts
def test_liggghts_deck_equals_the_session(tmp_path: Path) -> None:
    scene = hopper_scene("liggghts", **SHORT)
    program = build_program(scene)
    summary = run_by_hand(program, tmp_path / "hand", executable() or "liggghts")
    session = open_liggghts(scene, tmp_path)
    run_through(session, program)
    assert session.steps == summary["steps"]
    top, speed = session.values(["c_top", "v_rms_speed"])
    session.close()
    assert top == summary["largest_height_m"]
    assert speed == summary["rms_speed_m_s"]
