"""LAMMPS goes back to a kept state: what follows is what followed before, loads included."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest

from sandmould.engines.lammps.session import LammpsSession
from sandmould.engines.session import RefusedError
from tests.scenes import open_lammps, tube_scene
from tests.verification.test_lammps_callback import hill

RECORDS = 3
SAME = 1e-9
REST = {"check_every_s": 0.02}
"""A whole swing of the box, in which sand presses on all surfaces."""


def follow(session: LammpsSession) -> dict[str, Any]:
    """Some records on: grains, and the loads of the first record's walls and vertices."""
    session.advance()
    walls, vertices = session.surface_loads(), session.vertex_loads("hill")
    for _ in range(RECORDS):
        session.advance()
    now = session.snapshot()
    grains = {"x": now.position_m, "v": now.velocity_m_s, "spin": now.spin_rad_s}
    return {**grains, **(walls or {}), "vertices": vertices}


@pytest.mark.slow
@pytest.mark.parametrize("frame", ["box", "laboratory"])
def test_what_follows_follows_again(frame: str, tmp_path: Path) -> None:
    form = {"form": "nonviscous_isotropic"}
    shake = {"acceleration_g": 1.5, "frequency_hz": 50.0, "duration_s": 0.3}
    fill = {"layers": [{"count": 60}]}
    scenario = hill(frame=frame, fill=fill, vibration=[shake], background_damping=form, rest=REST)
    session = open_lammps(scenario, tmp_path)
    session.insert_layer(1)
    session.start_stage(session._program.stages[1])
    while session.time_s < 0.1:  # sand has come down on the hill
        session.advance()
    session.save_checkpoint()
    # kept where a record is half over and the hill on its way
    drawn_m = scenario.scene.outlines[0].vertices_m
    record = session._counts.check
    session.move_surface("hill", drawn_m - [0.0, 1e-4], record * session.step_s)
    session.advance(record // 2 * session.step_s)
    session.vertex_loads("hill")
    checkpoint = session.save_checkpoint()
    straight = follow(session)
    steps = session.steps
    for _ in range(2):
        session.restore_checkpoint(checkpoint)
        again = follow(session)
        assert session.steps == steps
        for name, values in straight.items():
            scale = np.abs(values).max()
            np.testing.assert_allclose(
                again[name], values, rtol=0.0, atol=SAME * scale, err_msg=name
            )
    assert RECORDS * record > 300
    assert straight["hill"][1] < -0.1
    session.close()


def test_sampled_loads_are_those_of_the_decks_own_fix(tmp_path: Path) -> None:
    session = open_lammps(hill(fill={"layers": [{"count": 60}]}), tmp_path)
    session.insert_layer(1)
    session.start_stage(session._program.stages[0])
    session.save_checkpoint()
    logged = (tmp_path / "engine.log").read_text(encoding="utf-8")
    while session.time_s < 0.1:
        session.advance()
    assert (tmp_path / "engine.log").read_text(encoding="utf-8") == logged
    assert "nothing more is logged" in logged
    assert not [path for path in tmp_path.iterdir() if path.name.startswith("kept_")]
    sampled = session.surface_loads()
    assert sampled is not None
    own = dict(zip(session._surfaces, session._recorded_loads(), strict=True))
    assert own["floor"][1] < -0.1
    for name, force in own.items():
        np.testing.assert_allclose(sampled[name], force, rtol=1e-12)
    session.close()


def test_what_cannot_go_back_is_told(tmp_path: Path) -> None:
    session = open_lammps(tube_scene(), tmp_path)
    with pytest.raises(RefusedError, match=r"pattern = None .* to go back on engine lammps"):
        session.save_checkpoint()
    session.close()
    session = open_lammps(hill(fill={"layers": [{"count": 2}]}), tmp_path)
    session.insert_layer(1)
    session.start_stage(session._program.stages[0])
    session.advance(1e-3)
    with pytest.raises(RefusedError, match=r"first kept step = .* start of a check"):
        session.save_checkpoint()
    session.close()
