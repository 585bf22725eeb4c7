"""LIGGGHTS's loads, frames, checkpoints and failures."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from sandmould.engines.guard import grain_masses_kg
from sandmould.engines.liggghts.process import read_grains
from sandmould.engines.liggghts.session import LiggghtsSession
from sandmould.engines.session import EngineStop, RefusedError, StepMover
from sandmould.runs.outcome import Outcome
from sandmould.scenario.scenario import Scenario
from tests.liggghts_scenes import (
    RADIUS_M,
    SOFT,
    liggghts_scene,
    needs_liggghts,
    one_grain_scene,
    open_liggghts,
    put_grain,
)

pytestmark = needs_liggghts


def settled(scene: Scenario, folder: Path) -> LiggghtsSession:
    session = open_liggghts(scene, folder)
    session.insert_layer(1)
    session.start_stage(session._program.stages[0])
    while not session.stage_over:
        session.advance()
    return session


@pytest.mark.parametrize("dimension", [2, 3])
def test_weight_of_a_bed_at_rest_is_the_load_on_floor_walls_and_obstacles(
    dimension: int, tmp_path: Path
) -> None:
    plate = {"kind": "plate", "centre_m": [0.02, 0.02, 0.01], "size_m": [0.02, 0.02, 0.005]}
    wedge = {
        "kind": "polygon",
        "name": "plate",
        "vertices_m": [[0.01, 0.005], [0.03, 0.005], [0.02, 0.02]],
    }
    scene = liggghts_scene(
        dimension=dimension,
        box={"width_m": 0.04, "depth_m": 0.04, "height_m": 0.08},
        obstacles=[{**plate, "angle_deg": 20}] if dimension == 3 else [wedge],
        contact=SOFT if dimension == 3 else {},
        fill={"layers": [{"count": 40}], "settling": {"longest_s": 4.0}},
        # with 0.5 spheres tremble on at 1e-4 m/s, on the reference engine too
        time_step={"fraction": 0.35 if dimension == 3 else 0.5},
        rest={"rms_speed_m_s": 1e-4},
        vibration=[],
    )
    session = settled(scene, tmp_path)
    assert session.at_rest
    session.start_stage(session._program.stages[0])  # a second run begins: its means stay right
    session.advance()
    loads = session.surface_loads()
    assert loads is not None
    weight = grain_masses_kg(scene, session.snapshot()).sum() * scene.gravity_m_s2
    assert set(loads) == {"floor", "left", "right", "plate"} | (
        {"front", "back"} if dimension == 3 else set()
    )
    total = sum(loads.values())
    assert total[-1] == pytest.approx(-weight, rel=2e-3)
    assert np.abs(total[:-1]).max() < 2e-3 * weight
    assert loads["left"][0] <= 0 <= loads["right"][0]  # the sand pushes both walls outwards
    for name in loads:
        exported = session.triangle_loads(name).force_n.sum(axis=0)
        now = session.values([f"f_surface_{name}[{i + 1}]" for i in range(3)])
        np.testing.assert_allclose(exported, now, atol=1e-6 * weight)
    assert loads["floor"][-1] == pytest.approx(
        session.triangle_loads("floor").force_n.sum(axis=0)[dimension - 1], rel=0.01
    )
    session.close()


def test_planes_of_spheres_stay_planes(tmp_path: Path) -> None:
    session = settled(liggghts_scene(fill={"layers": [{"count": 60}]}), tmp_path)
    session.snapshot()
    id_to_radius = read_grains(Path(session._scratch.name) / "grains.bin")
    session.close()
    out_of_plane = id_to_radius[:, [3, 6, 7, 8]]  # z, its velocity, the spins that tilt the plane
    np.testing.assert_array_equal(out_of_plane, 0.0)
    assert np.abs(id_to_radius[:, 9]).max() > 0


@pytest.mark.slow
@pytest.mark.parametrize(
    ("dimension", "direction", "ramp_s"), [(2, [0.6, 0.8], 0.01), (3, "vertical", 0.0)]
)
def test_one_grain_moves_alike_in_both_frames(
    dimension: int, direction: object, ramp_s: float, tmp_path: Path
) -> None:
    stage = {
        "acceleration_g": 3.0,
        "frequency_hz": 50.0,
        "duration_s": 0.04,
        "direction": direction,
        "ramp_s": ramp_s,
    }
    tracks, off_course = [], []
    for frame in ("box", "laboratory"):
        scene = one_grain_scene(
            dimension=dimension,
            frame=frame,
            vibration=[stage],
            measure_at_rest=False,
            contact=SOFT if dimension == 3 else {},
            time_step={"fraction": 0.4},
            # no setup within the stage: LIGGGHTS forgets the velocity of moving walls there
            rest={"check_every_s": 5e-3, "load_every_steps": 1},
            record={"series_every_s": 5e-3, "snapshot_every_s": 5e-3},
        )
        folder = tmp_path / frame
        folder.mkdir()
        session = open_liggghts(scene, folder)
        put_grain(session, RADIUS_M, [0.0] * dimension)
        session.start_stage(session._program.stages[1])
        vibration = scene.vibration[0]
        track = []
        while not session.stage_over:
            session.advance(1e-3)
            snapshot = session.snapshot()
            track.append([*snapshot.position_m[0], *snapshot.velocity_m_s[0]])
            floor = session.triangle_loads("floor").corners_m[..., dimension - 1].mean()
            # s(t) from one step into the stage; the export prints six digits.
            t = (session.steps - session._stage_start - 1) * scene.step_s
            course = (
                float(vibration.displacements_at(np.array(t)))
                * vibration.unit_direction(dimension)[-1]
            )
            off_course.append(floor - (course if frame == "laboratory" else 0.0))
        session.close()
        tracks.append(np.array(track))
    box, laboratory = tracks
    assert np.ptp(box[:, dimension - 1]) > 4e-4  # the grain was thrown
    np.testing.assert_allclose(box, laboratory, atol=2e-9)
    assert np.abs(off_course).max() < 2e-9


def run_to(session: LiggghtsSession, stage_name: str) -> None:
    """Compute up to the first checkpoint that a stage allows after its beginning."""
    for stage in session._program.stages:
        if stage.layer:
            session.insert_layer(stage.layer)
        session.start_stage(stage)
        if stage.name == stage_name:
            break
        while not session.stage_over:
            session.advance()
        session.end_stage()
    session.advance(0.02)
    session.advance()
    assert session.can_checkpoint


@pytest.mark.parametrize(
    ("frame", "stage"), [("box", "settle_2"), ("box", "vibrate_1"), ("laboratory", "settle_2")]
)
def test_restored_equals_straight(frame: str, stage: str, tmp_path: Path) -> None:
    scene = liggghts_scene(
        frame=frame,
        fill={"layers": [{"count": 40, "repeat": 2}]},
        rest={"rms_speed_m_s": 0.05},
    )
    session = open_liggghts(scene, tmp_path)
    run_to(session, stage)
    session.write_checkpoint(tmp_path)
    restored = open_liggghts(scene, tmp_path, checkpoint=tmp_path)
    loads = []
    for one in (session, restored):
        one.advance(1000 * scene.step_s)
        one.advance()
        loads.append(one.surface_loads())
    a, b = session.snapshot(), restored.snapshot()
    session.close()
    restored.close()
    assert a.time_s == b.time_s
    for name in ("vibration_time_s", "position_m", "velocity_m_s", "spin_rad_s", "radius_m", "id"):
        np.testing.assert_array_equal(getattr(a, name), getattr(b, name))
    assert loads[0] is not None
    assert loads[1] is not None
    for surface, force in loads[0].items():
        np.testing.assert_array_equal(force, loads[1][surface])


def test_restored_in_moving_walls_loses_one_force(tmp_path: Path) -> None:
    scene = liggghts_scene(
        frame="laboratory",
        fill={"layers": [{"count": 40}]},
        rest={"rms_speed_m_s": 0.05},
    )
    session = open_liggghts(scene, tmp_path)
    run_to(session, "vibrate_1")
    session.write_checkpoint(tmp_path)
    restored = open_liggghts(scene, tmp_path, checkpoint=tmp_path)
    for one in (session, restored):
        one.advance(100 * scene.step_s)
    apart = np.abs(session.snapshot().velocity_m_s - restored.snapshot().velocity_m_s).max()
    stage = scene.vibration[0]
    session.close()
    restored.close()
    assert 0 < apart < 0.2 * stage.amplitude_m * stage.angular_frequency_rad_s


def test_grain_outside_the_simulation_box_is_a_lost_grain(tmp_path: Path) -> None:
    session = open_liggghts(one_grain_scene(), tmp_path)
    put_grain(session, 0.01, [5000.0, 0.0])
    with pytest.raises(EngineStop) as stop:
        session.send("run 20000")
    session.close()
    assert stop.value.outcome is Outcome.LOST_GRAINS
    assert "LIGGGHTS says: ERROR: Lost atoms" in stop.value.detail


def test_error_of_liggghts_is_quoted_and_its_death_noticed(tmp_path: Path) -> None:
    session = open_liggghts(one_grain_scene(), tmp_path)
    with pytest.raises(EngineStop, match="Unknown command: no_such_command") as stop:
        session.send("no_such_command")
    assert stop.value.outcome is Outcome.ENGINE_FAILED
    with pytest.raises(EngineStop):
        session.send("run 0")
    session.close()
    session = open_liggghts(one_grain_scene(), tmp_path)
    session._liggghts._process.terminate()  # meant for us, who may still want a checkpoint
    assert session.values(["1+1"]) == [2.0]
    session._liggghts._process.kill()
    with pytest.raises(EngineStop, match="ended with status -9"):
        session.send("run 0")
    session.close()


def test_surfaces_are_rigid(tmp_path: Path) -> None:
    session = open_liggghts(one_grain_scene(), tmp_path)
    with pytest.raises(RefusedError, match="the pattern of the scenario on engine"):
        session.move_surface("floor", np.zeros((2, 2)), 0.01)
    with pytest.raises(RefusedError, match="the pattern of the scenario on engine"):
        session.attach_mover("floor", StepMover(0, 0, np.zeros((2, 2)), np.zeros((2, 2))))
    session.close()
    assert not list(tmp_path.glob("liggghts_*"))
