"""One grain in LAMMPS: what the session does with it. Exact results are in ``test_cases.py``."""

from __future__ import annotations

import math
from pathlib import Path

import pytest

from sandmould.engines.lammps.session import LammpsSession
from sandmould.engines.program import Stage
from sandmould.engines.session import EngineStop
from sandmould.runs.outcome import Outcome
from tests.scenes import open_lammps
from tests.verification.one_grain import RADIUS_M, one_grain_scene


def put_grain(session: LammpsSession, height_m: float, speed_m_s: float) -> None:
    """Place the one grain over the middle of the floor."""
    session.insert_layer(1)
    middle = session._scenario.box.width_m / 2
    session.send(f"set atom 1 x {middle!r} y {height_m!r}\nvelocity all set 0 {speed_m_s!r} 0")


def test_grain_outside_the_simulation_box_is_a_lost_grain(tmp_path: Path) -> None:
    session = open_lammps(one_grain_scene(), tmp_path)
    put_grain(session, 0.01, 0.0)
    session.start_stage(session._program.stages[0])
    session.send("velocity all set 5000 0 0")
    with pytest.raises(EngineStop) as stop:
        session.advance(1.0)
    assert stop.value.outcome is Outcome.LOST_GRAINS
    assert "LAMMPS says" in stop.value.detail


def test_stage_of_vibration_lasts_whole_periods_and_a_step_at_either_end(tmp_path: Path) -> None:
    stage = {"acceleration_g": 1.0, "frequency_hz": 30.0, "duration_s": 0.1}
    scene = one_grain_scene(vibration=[stage], time_step={"fraction": 0.5})
    session = open_lammps(scene, tmp_path)
    put_grain(session, RADIUS_M, 0.0)
    last: Stage = session._program.stages[1]
    session.start_stage(last)
    while not session.stage_over:
        session.advance()
    steps = session.steps
    session.close()
    assert steps == math.ceil(0.1 / scene.step_s) + 2
