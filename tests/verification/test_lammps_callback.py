"""Surfaces and damping that LAMMPS takes from our kernels, against its own and exact results."""

from __future__ import annotations

import math
import subprocess
import sys
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from sandmould.engines.driver import Driver
from sandmould.engines.lammps.render import write_deck
from sandmould.engines.lammps.session import LammpsSession, refuse
from sandmould.engines.outcome import Outcome
from sandmould.engines.program import build_program
from sandmould.engines.session import RefusedError
from sandmould.scenario.scenario import Scenario
from tests.scenes import open_lammps
from tests.verification.test_single_contact import RADIUS_M, one_grain_scene

TOP_M = 0.01
PLATE = {"kind": "plate", "name": "slab", "centre_m": [0.025, 0.0075], "size_m": [0.05, 0.005]}
SLAB: dict[str, Any] = {
    "kind": "polygon",
    "name": "slab",
    "vertices_m": [
        [0.0, 0.005], [0.05, 0.005], [0.05, TOP_M], [0.031, TOP_M], [0.025, TOP_M],
        [0.02, TOP_M], [0.0, TOP_M],
    ],
}  # fmt: skip
"""The same slab as the plate, its top in four edges."""
# Full critical damping LAMMPS can only come near to, by a restitution of 1e-100.
SMOOTH = {
    "grain_wall": {
        "normal_stiffness_n_m": 2e4,
        "friction": 0.0,
        "damping_ratio": 0.95,
        "rolling_arm_fraction": 0.0,
    }
}
SHAKE = {"acceleration_g": 3.0, "frequency_hz": 50.0, "duration_s": 0.06, "direction": [0.6, 0.8]}


def scene(obstacle: dict[str, Any], **changes: Any) -> Scenario:
    """One grain over a slab, with a step at which a contact takes some hundred steps."""
    return one_grain_scene(obstacles=[obstacle], **{"time_step": {"fraction": 0.2}} | changes)


def put_grain(session: LammpsSession, place: list[float], speed: list[float]) -> None:
    """Insert the one grain and place it."""
    session.insert_layer(1)
    session.set_state(np.array([place]), np.array([speed]), np.zeros((1, 3)))


def track(session: LammpsSession, windows: int) -> np.ndarray:
    """Place, velocity, spin and load on the slab after each window of the running stage."""
    rows = []
    while not session.stage_over and len(rows) < windows:
        session.advance()
        now, loads = session.snapshot(), session.surface_loads()
        if loads is None:  # a stage may end inside a window
            break
        rows.append([*now.position_m[0], *now.velocity_m_s[0], *now.spin_rad_s[0], *loads["slab"]])
    return np.array(rows)


def test_polygon_without_friction_equals_a_plate_of_lammps(tmp_path: Path) -> None:
    tracks = []
    for obstacle in (PLATE, SLAB):
        folder = tmp_path / str(obstacle["kind"])
        folder.mkdir()
        session = open_lammps(scene(obstacle, contact=SMOOTH), folder)
        put_grain(session, [0.018, TOP_M + RADIUS_M * 1.1], [0.3, -0.2])
        session.start_stage(session._program.stages[0])
        tracks.append(track(session, 400))
        session.close()
    plate, polygon = tracks
    assert plate[-1, 0] > 0.029  # over two joints
    assert plate[:, -1].min() < -0.5  # and pressed on the slab
    np.testing.assert_allclose(polygon, plate, rtol=1e-9, atol=1e-12)


def test_friction_on_a_polygon_equals_that_on_a_plate_while_the_grain_slides(
    tmp_path: Path,
) -> None:
    tracks = []
    for obstacle in (PLATE, SLAB):
        folder = tmp_path / str(obstacle["kind"])
        folder.mkdir()
        session = open_lammps(scene(obstacle), folder)
        put_grain(session, [0.018, TOP_M + RADIUS_M * 0.999], [0.6, 0.0])
        session.start_stage(session._program.stages[0])
        tracks.append(track(session, 100))
        session.close()
    plate, polygon = tracks
    spin = np.abs(plate[:, 6])
    # It slides faster than it rolls all the way, over the joint at 20 mm.
    assert (plate[:, 2] - 1.1 * spin * RADIUS_M).min() > 0.0
    assert plate[-1, 0] > 0.0205
    still = [0, 1, 2, 3, 7, 8]
    np.testing.assert_allclose(polygon[:, still], plate[:, still], rtol=1e-9, atol=1e-12)
    # LAMMPS turns a grain at the arm r, the kernel at its distance from the wall, r - u.
    np.testing.assert_allclose(polygon[:, 6], plate[:, 6], rtol=1.5e-3)


@pytest.mark.parametrize("frame", ["box", "laboratory"])
def test_shaken_polygon_equals_a_shaken_plate(frame: str, tmp_path: Path) -> None:
    tracks = []
    for obstacle in (PLATE, SLAB):
        folder = tmp_path / str(obstacle["kind"])
        folder.mkdir()
        shaken = scene(obstacle, contact=SMOOTH, frame=frame, vibration=[SHAKE])
        session = open_lammps(shaken, folder)
        put_grain(session, [0.023, TOP_M + RADIUS_M], [0.0, 0.0])
        session.start_stage(session._program.stages[-1])
        tracks.append(track(session, 10_000))
        session.close()
    plate, polygon = tracks
    assert np.ptp(plate[:, 1]) > 4e-4  # the grain was thrown
    np.testing.assert_allclose(polygon, plate, rtol=1e-9, atol=1e-9)


@pytest.mark.parametrize("kind", ["cylinder", "mesh"])
def test_solids_of_3d_equal_a_plate_of_lammps(kind: str, tmp_path: Path) -> None:
    box = {"width_m": 0.05, "depth_m": 0.05, "height_m": 0.05}
    plate = {"kind": "plate", "name": "slab", "centre_m": [0.025, 0.025, 0.0075]}
    other: dict[str, Any] = {"kind": "cylinder", "name": "slab", "centre_m": [0.025, 0.025, 0.0075],
                             "diameter_m": 0.04, "length_m": 0.005}  # fmt: skip
    if kind == "mesh":
        path = tmp_path / "slab.stl"
        write_cuboid(path, np.array([0.005, 0.005, 0.005]), np.array([0.045, 0.045, TOP_M]))
        other = {"kind": "mesh", "name": "slab", "file": str(path)}
    tracks = []
    soft = {"normal_stiffness_n_m": 500.0, "tangential_stiffness_n_m": 500.0}
    contact = {"grain_grain": soft, "grain_wall": SMOOTH["grain_wall"] | soft}
    for obstacle in ({**plate, "size_m": [0.04, 0.04, 0.005]}, other):
        folder = tmp_path / str(obstacle["kind"])
        folder.mkdir()
        session = open_lammps(scene(obstacle, dimension=3, box=box, contact=contact), folder)
        put_grain(session, [0.02, 0.022, TOP_M + RADIUS_M * 1.1], [0.2, 0.1, -0.2])
        session.start_stage(session._program.stages[0])
        tracks.append(track(session, 200))
        session.close()
    assert tracks[0][:, -1].min() < -1e-3
    # The file keeps single precision: lengths to 6e-8 of themselves.
    tolerance = 1e-9 if kind == "cylinder" else 1e-5
    scale = np.abs(tracks[0]).max(axis=0)
    assert (np.abs(tracks[1] - tracks[0]).max(axis=0) <= tolerance * scale + 1e-12).all()


def write_cuboid(path: Path, low: np.ndarray, high: np.ndarray) -> None:
    """Write a cuboid as a text STL."""
    corner = [np.where([i & 4, i & 2, i & 1], high, low) for i in range(8)]
    quads = [(0, 1, 3, 2), (4, 6, 7, 5), (0, 4, 5, 1), (2, 3, 7, 6), (0, 2, 6, 4), (1, 5, 7, 3)]
    lines = ["solid slab"]
    for a, b, c, e in quads:
        for triangle in ((a, b, c), (a, c, e)):
            lines += ["facet normal 0 0 0", "outer loop"]
            lines += ["vertex " + " ".join(map(repr, corner[i].tolist())) for i in triangle]
            lines += ["endloop", "endfacet"]
    path.write_text("\n".join([*lines, "endsolid slab"]) + "\n", encoding="utf-8")


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
    found, steps = session.snapshot(), session.steps
    session.close()
    # Central differences of m a = m g - alpha m |g| v/|v|, eq. (38), by hand: half a step first.
    x, v = np.array([0.01, 0.015]), np.array([0.4, 0.2])

    def acceleration(v: np.ndarray) -> np.ndarray:
        return np.array([0.0, -g]) - 0.1 * g * v / np.linalg.norm(v)

    v = v + acceleration(v) * dt / 2
    for _ in range(steps):
        x = x + v * dt
        a = acceleration(v)
        v = v + a * dt
    np.testing.assert_allclose(found.position_m[0], x, rtol=1e-10)
    np.testing.assert_allclose(found.velocity_m_s[0], v - a * dt / 2, rtol=1e-9)
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
        "sand": {"size_scale": 8.0, "size_classes": 3},
        "fill": {"layers": [{"count": 40, "repeat": 2}], "settling": {"rms_speed_m_s": 1e-3}},
        "vibration": [{"acceleration_g": 1.5, "frequency_hz": 50.0, "duration_s": 0.06}],
        "record": {"snapshot_every_s": 0.02},
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
    shaken = scene(SLAB, frame=frame, vibration=[gentle], background_damping=DAMPED)
    straight = open_lammps(shaken, tmp_path)
    put_grain(straight, [0.0195, TOP_M + RADIUS_M * 0.999], [0.05, 0.0])
    straight.start_stage(straight._program.stages[-1])
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
    session = open_lammps(scene(SLAB, fill={"layers": [{"count": 1}], "settling": {
        "shortest_s": 0.1}}), tmp_path)  # fmt: skip
    put_grain(session, [0.0195, TOP_M + RADIUS_M], [0.0, 0.0])
    session.start_stage(session._program.stages[0])
    window_s = session._counts.window * session.step_s
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
    write_deck(build_program(scene(SLAB)), {}, tmp_path, "test", "test")
    first = (tmp_path / "deck.in").read_text(encoding="utf-8").splitlines()[0]
    assert "needs the force callback of a session, on one rank" in first
    lmp = Path(sys.executable).parent / "lmp"
    ran = subprocess.run([str(lmp), "-in", "deck.in"], cwd=tmp_path, capture_output=True, text=True)
    assert ran.returncode == 4
    assert "This deck needs the force callback of a session" in ran.stdout


def test_a_grain_rests_in_a_notch_on_both_its_sides(tmp_path: Path) -> None:
    notch = {
        "kind": "polygon",
        "name": "slab",
        "vertices_m": [[0.0, 0.005], [0.05, 0.005], [0.05, 0.02], [0.025, 0.01], [0.0, 0.02]],
    }
    session = open_lammps(scene(notch, contact=SMOOTH, fill={"layers": [{"count": 1}], "settling": {
        "shortest_s": 0.1, "rms_speed_m_s": 1e-5}}), tmp_path)  # fmt: skip
    slope = math.atan2(0.01, 0.025)
    put_grain(session, [0.025, 0.01 + RADIUS_M / math.cos(slope)], [0.0, 0.0])
    session.start_stage(session._program.stages[0])
    rows = track(session, 100_000)
    session.close()
    weight = session._scenario.sand.grain_mass_kg(2 * RADIUS_M, 2) * session._scenario.gravity_m_s2
    assert rows[-1, -1] == pytest.approx(-weight, rel=1e-3)
    # Both sides carry: 2 k u cos(slope) = m g with u the overlap at either side.
    overlap = RADIUS_M - (rows[-1, 1] - 0.01) * math.cos(slope)
    assert 2 * 2e4 * overlap * math.cos(slope) == pytest.approx(weight, rel=1e-3)
