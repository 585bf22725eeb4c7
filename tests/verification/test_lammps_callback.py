"""Sessions of LAMMPS with forces of our kernels: damping, loads, checkpoints, moving surfaces."""

from __future__ import annotations

import subprocess
import sys
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from sandmould.engines.driver import Driver
from sandmould.engines.lammps.render import write_deck
from sandmould.engines.lammps.session import LammpsSession, refuse
from sandmould.engines.program import build_program
from sandmould.engines.session import RefusedError
from sandmould.runs.outcome import Outcome
from sandmould.scenario.scenario import Scenario
from tests.scenes import open_lammps
from tests.verification.one_grain import (
    PLATE,
    RADIUS_M,
    SHAKE,
    SLAB,
    TOP_M,
    one_grain_scene,
    put_grain,
    slab_scene,
    track,
)

DAMPED = {"form": "nonviscous_isotropic", "nonviscous_translation": 0.1, "nonviscous_rotation": 0.3}


@pytest.mark.parametrize("dimension", [2, 3])
def test_isotropic_damping_of_a_thrown_grain(dimension: int, tmp_path: Path) -> None:
    soft = {"normal_stiffness_n_m": 500.0, "tangential_stiffness_n_m": 500.0}
    thrown = one_grain_scene(
        dimension=dimension,
        background_damping=DAMPED,
        contact={"grain_grain": soft, "grain_wall": soft},
        time_step={"fraction": 0.2},
    )
    session = open_lammps(thrown, tmp_path)
    up = [0.0] * (dimension - 1)
    put_grain(session, [*[0.025] * (dimension - 1), 0.01], [*up, 0.3])
    session.start_stage(session._program.stages[0])
    heights, speeds, times = [], [], []
    start = session.time_s
    while session.time_s - start < 0.05:
        session.advance()
        now = session.snapshot()
        heights.append(now.position_m[0, -1])
        speeds.append(now.velocity_m_s[0, -1])
        times.append(session.time_s - start)
    session.close()
    g = thrown.gravity_m_s2
    turn = 0.3 / (1.1 * g)
    t = np.array(times)
    # |F| = m g throughout: slowed by g(1 + alpha) on the way up, sped up by g(1 - alpha) down.
    expected = np.where(t < turn, 0.3 - 1.1 * g * t, -0.9 * g * (t - turn))
    np.testing.assert_allclose(speeds, expected, atol=2.5 * g * thrown.step_s)
    top = 0.01 + 0.3**2 / (2 * 1.1 * g)
    assert max(heights) == pytest.approx(top, abs=1e-3 * (top - 0.01))


def test_isotropic_damping_takes_the_whole_vector(tmp_path: Path) -> None:
    flight = one_grain_scene(background_damping=DAMPED, time_step={"fraction": 0.2})
    session = open_lammps(flight, tmp_path)
    put_grain(session, [0.01, 0.015], [0.4, 0.2])
    session.start_stage(session._program.stages[0])
    g, dt = flight.gravity_m_s2, flight.step_s
    while session.time_s < 0.03:
        session.advance()
    found, steps, setup = session.snapshot(), session.steps, session._counts.setup
    session.close()
    # Central differences of m a = m g - alpha m |g| v/|v|, eq. (38), by hand: half a step first.
    # In a setup the force is computed once more, with the velocity of the whole step.
    x, v = np.array([0.01, 0.015]), np.array([0.4, 0.2])

    def acceleration(v: np.ndarray) -> np.ndarray:
        return np.array([0.0, -g]) - 0.1 * g * v / np.linalg.norm(v)

    for step in range(steps):
        if step % setup == 0:
            a = acceleration(v)
        v = v + a * dt / 2
        x = x + v * dt
        a = acceleration(v)
        v = v + a * dt / 2
    np.testing.assert_allclose(found.position_m[0], x, rtol=1e-10)
    np.testing.assert_allclose(found.velocity_m_s[0], v, rtol=1e-9)
    # Component by component the horizontal velocity would not change: no force acts along it.
    assert found.velocity_m_s[0, 0] < 0.385


def hill(**changes: Any) -> Scenario:
    """A small box with a hill of straight edges in it, sand in layers."""
    base: dict[str, Any] = {
        "box": {"width_m": 0.08, "height_m": 0.08},
        "obstacles": [
            {
                "kind": "polygon",
                "name": "hill",
                "vertices_m": [[0.02, 0.002], [0.06, 0.002], [0.06, 0.01], [0.045, 0.02],
                               [0.03, 0.018], [0.02, 0.01]],
            }
        ],
        "sand": {"size_scale": 8.0, "size_classes": 3, "disc_thickness_m": 0.1},
        "fill": {"layers": [{"count": 40, "repeat": 2}]},
        "rest": {"rms_speed_m_s": 1e-3},
        "vibration": [{"acceleration_g": 1.5, "frequency_hz": 50.0, "duration_s": 0.06}],
        "record": {"snapshot_every_s": 0.02},
        "time_step": {"bed_fraction": 0.0},
    }  # fmt: skip
    return Scenario.model_validate(base | changes)


def fill(session: LammpsSession) -> None:
    """Insert and settle all layers."""
    for stage in session._program.stages:
        if stage.layer:
            session.insert_layer(stage.layer)
            session.start_stage(stage)
            while not session.stage_over:
                session.advance()
            assert session.at_rest
            session.end_stage()


@pytest.mark.parametrize("form", ["nonviscous_isotropic", "nonviscous_componentwise"])
def test_loads_of_sand_at_rest_carry_its_weight(form: str, tmp_path: Path) -> None:
    sand = hill(background_damping={"form": form})
    session = open_lammps(sand, tmp_path)
    fill(session)
    loads = session.surface_loads()
    session.close()
    assert loads is not None
    masses = [sand.sand.grain_mass_kg(2 * r, 2) for r in np.concatenate(
        [layer.radius_m for layer in session._program.layers])]  # fmt: skip
    weight = sum(masses) * sand.gravity_m_s2
    total = np.sum(list(loads.values()), axis=0)
    assert total[1] == pytest.approx(-weight, rel=0.02)
    assert total[0] == pytest.approx(0.0, abs=0.02 * weight)
    assert loads["hill"][1] < -0.2 * weight


@pytest.mark.parametrize("frame", ["box", "laboratory"])
def test_checkpoint_with_a_polygon_goes_on_bit_for_bit(frame: str, tmp_path: Path) -> None:
    gentle = SHAKE | {"acceleration_g": 0.5}
    shaken = slab_scene(SLAB, frame=frame, vibration=[gentle], background_damping=DAMPED)
    straight = open_lammps(shaken, tmp_path)
    put_grain(straight, [0.0195, TOP_M + RADIUS_M * 0.999], [0.05, 0.0])
    straight.start_stage(straight._program.stages[1])
    for _ in range(60):
        straight.advance()
    mark = tmp_path / "mark"
    mark.mkdir()
    straight.write_checkpoint(mark)
    resumed = open_lammps(shaken, tmp_path, mark)
    tracks = [track(session, 200) for session in (straight, resumed)]
    for session in (straight, resumed):
        last = tmp_path / f"last_{session is straight}"
        last.mkdir()
        session.write_checkpoint(last)
        session.close()
    np.testing.assert_array_equal(tracks[1], tracks[0])
    assert np.abs(tracks[0][:, 7]).max() > 0.005  # friction was at work
    with (
        np.load(tmp_path / "last_True/kernel.npz") as a,
        np.load(tmp_path / "last_False/kernel.npz") as b,
    ):
        assert a["used"].any()
        for name in a.files:
            np.testing.assert_array_equal(a[name], b[name])


def test_list_too_short_for_its_array_changes_nothing(tmp_path: Path) -> None:
    finals = []
    for short in (False, True):
        folder = tmp_path / str(short)
        folder.mkdir()
        session = open_lammps(hill(), folder)
        kernel = session._kernel
        assert kernel is not None
        session.insert_layer(1)
        if short:
            kernel._replace(part=np.zeros(0, dtype=np.int64))
        session.start_stage(session._program.stages[0])
        for _ in range(12):
            session.advance()
        finals.append(session.snapshot().position_m)
        assert len(kernel._bridge.part) > 0
        session.close()
    np.testing.assert_array_equal(finals[0], finals[1])


def test_polygon_moves_with_its_sand_and_drags_it(tmp_path: Path) -> None:
    session = open_lammps(slab_scene(SLAB, fill={"layers": [{"count": 1}], "settling": {
        "shortest_s": 0.1}}), tmp_path)  # fmt: skip
    put_grain(session, [0.0195, TOP_M + RADIUS_M], [0.0, 0.0])
    session.start_stage(session._program.stages[0])
    window_s = session._counts.check * session.step_s
    for _ in range(20):
        session.advance()
    before = session.snapshot()
    vertices = np.array(SLAB["vertices_m"])
    speed = np.array([0.02, 0.01])
    for _ in range(400):
        vertices = vertices + speed * window_s
        session.move_surface("slab", vertices, window_s)
        session.advance()
    after = session.snapshot()
    kernel = session._kernel
    assert kernel is not None
    # One call more at the start of a run moves nothing: the target is met exactly.
    np.testing.assert_allclose(kernel._bridge.vertices, vertices, rtol=1e-12)
    risen = after.position_m[0, 1] - before.position_m[0, 1]
    assert risen == pytest.approx(400 * speed[1] * window_s, rel=1e-2)
    # Rolling resistance brings the disc to rest on the slab: it goes with it.
    assert after.velocity_m_s[0, 0] == pytest.approx(speed[0], rel=0.05)
    with pytest.raises(RefusedError, match="floor"):
        session.move_surface("floor", vertices, window_s)
    session.close()


def test_driver_runs_a_scene_with_a_polygon(tmp_path: Path) -> None:
    sand = hill(fill={"layers": [{"count": 30}]}, background_damping=DAMPED)
    program = build_program(sand)
    write_deck(program, {}, tmp_path, "test", "test")
    outcome = Driver(program, tmp_path, "test", "hash").run()
    assert outcome.outcome is Outcome.FINISHED, outcome.detail


@pytest.mark.parametrize(
    "changes",
    [{"obstacles": [SLAB]}, {"background_damping": {"form": "nonviscous_isotropic"}}],
)
def test_callback_is_refused_under_mpi(changes: dict[str, Any]) -> None:
    refuse(one_grain_scene(**changes))
    refuse(one_grain_scene(obstacles=[PLATE], engine={"ranks": 2}))
    with pytest.raises(RefusedError, match=r"engine\.ranks"):
        refuse(one_grain_scene(**changes, engine={"ranks": 2}))


def test_deck_run_by_hand_says_that_it_needs_a_session(tmp_path: Path) -> None:
    write_deck(build_program(slab_scene(SLAB)), {}, tmp_path, "test", "test")
    first = (tmp_path / "deck.in").read_text(encoding="utf-8").splitlines()[0]
    assert "needs the force callback of a session, on one rank" in first
    lmp = Path(sys.executable).parent / "lmp"
    ran = subprocess.run([str(lmp), "-in", "deck.in"], cwd=tmp_path, capture_output=True, text=True)
    assert ran.returncode == 4
    assert "This deck needs the force callback of a session" in ran.stdout
