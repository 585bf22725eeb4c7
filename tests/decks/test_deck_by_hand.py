"""A deck that a person runs with lmp gives what the session gives."""

from __future__ import annotations

import subprocess
import sys
from pathlib import Path

import pytest
import yaml

from sandmould.engines.lammps.render import write_deck
from sandmould.engines.program import build_program
from tests.scenes import open_lammps, tube_scene

LMP = Path(sys.executable).parent / "lmp"


@pytest.mark.parametrize("frame", ["box", "laboratory"])
def test_deck_by_hand_equals_the_session_to_the_last_digit(frame: str, tmp_path: Path) -> None:
    scene = tube_scene(frame=frame, fill={"layers": [{"count": 40, "repeat": 2}]})
    program = build_program(scene)
    hand, own = tmp_path / "hand", tmp_path / "own"
    own.mkdir()
    write_deck(program, {}, hand, "test", "test")
    ran = subprocess.run([str(LMP), "-in", "deck.in"], cwd=hand, capture_output=True, text=True)
    assert ran.returncode == 0, ran.stdout[-2000:]
    summary = yaml.safe_load((hand / "summary.yaml").read_text())
    assert summary["grains"] == 80

    session = open_lammps(scene, own)
    for stage in program.stages:
        if stage.layer:
            session.insert_layer(stage.layer)
        session.start_stage(stage)
        while not session.stage_over:
            session.advance()
        session.end_stage()
    assert session.steps == summary["steps"]
    session.send("variable bed_top equal c_top")
    ours = {name: session._lmp.extract_variable(name) for name in ("rms_speed", "bed_top")}
    session.close()
    # A sum over all grains and a maximum, to the 15 digits that LAMMPS prints: grains of another
    # path would part by far more within a few collisions.
    assert ours["rms_speed"] == pytest.approx(summary["rms_speed_m_s"], rel=1e-14)
    assert ours["bed_top"] == pytest.approx(summary["largest_height_m"], rel=1e-14)
    assert (hand / "grains.dump").read_text().count("ITEM: TIMESTEP") > 2
