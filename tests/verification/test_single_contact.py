"""One grain against exact results: restitution, energy, frames."""

from __future__ import annotations

import math
from pathlib import Path

import numpy as np
import pytest

from sandmould.engines.lammps.session import LammpsSession
from sandmould.engines.outcome import Outcome
from sandmould.engines.program import Stage
from sandmould.engines.session import EngineStop
from sandmould.scenario.scenario import Scenario
from tests.scenes import open_lammps

RADIUS_M = 0.002


def one_grain_scene(**changes: object) -> Scenario:
    """Give an empty box of which only the floor matters."""
    base: dict[str, object] = {
        "box": {"width_m": 0.05, "height_m": 0.05},
        "sand": {
            "size_scale": 1.0,
            "size_classes": 1,
            "sieve": [
                {"opening_m": 2 * RADIUS_M / 1.001, "passing_fraction": 0},
                {"opening_m": 2 * RADIUS_M * 1.001, "passing_fraction": 1},
            ],
        },
        "fill": {"layers": [{"count": 1}]},
        "background_damping": {"form": "none"},
        "time_step": {"fraction": 0.01},
        "record": {"load_every_steps": 1, "series_every_s": 1e-4, "snapshot_every_s": 1e-4},
    }
    return Scenario.model_validate(base | changes)


def put_grain(session: LammpsSession, height_m: float, speed_m_s: float) -> None:
    """Place the one grain over the middle of the floor."""
    session.insert_layer(1)
    middle = session._scenario.box.width_m / 2
    session.send(f"set atom 1 x {middle!r} y {height_m!r}\nvelocity all set 0 {speed_m_s!r} 0")


def law(damping_ratio: float) -> dict[str, object]:
    """Give both contact laws one damping ratio and no friction."""
    wall = {"damping_ratio": damping_ratio, "normal_stiffness_n_m": 2e4, "friction": 0.0}
    return {"grain_wall": wall | {"rolling_arm_fraction": 0.0}}


def exact_restitution(damping_ratio: float, no_tension: str) -> float:
    """Give the restitution of a linear spring and dashpot.

    Elastic part alone clipped: the contact ends where the overlap does, half a period after the
    first touch. Total force clipped: it ends where the force first vanishes (Schwager and
    Poeschel 2007), which tends to exp(-2) at critical damping.
    """
    z = damping_ratio
    if z == 1.0:
        return math.exp(-2) if no_tension == "total" else 0.0
    root = math.sqrt(1 - z * z)
    angle = math.pi if no_tension == "elastic" else math.atan2(2 * z * root, 2 * z * z - 1)
    return math.exp(-z / root * angle)


@pytest.mark.parametrize("no_tension", ["total", "elastic"])
@pytest.mark.parametrize("damping_ratio", [0.05, 0.3, 0.7, 0.95, 1.0])
def test_restitution_equals_the_exact_value(
    damping_ratio: float, no_tension: str, tmp_path: Path
) -> None:
    contact = {**law(damping_ratio), "no_tension": no_tension}
    scene = one_grain_scene(contact=contact, gravity_m_s2=0.0)
    session = open_lammps(scene, tmp_path)
    put_grain(session, RADIUS_M * 1.001, -0.1)
    mass = scene.sand.grain_mass_kg(2 * RADIUS_M, 2)
    period = 2 * math.pi * math.sqrt(mass / 2e4)
    # A critically damped contact that may pull never ends: three periods are as good as for ever.
    session.send(f"run {math.ceil((3 * period + 2 * RADIUS_M * 0.001 / 0.1) / scene.step_s)}")
    rebound = float(session.snapshot().velocity_m_s[0, 1]) / 0.1
    session.close()
    # The dashpot sees the velocity half a step late: first order in dt, 1.1e-4 at this step.
    assert rebound == pytest.approx(exact_restitution(damping_ratio, no_tension), abs=3e-4)


def test_energy_of_an_undamped_bounce_is_kept(tmp_path: Path) -> None:
    scene = one_grain_scene(contact=law(0.0))
    session = open_lammps(scene, tmp_path)
    height = RADIUS_M + 0.001
    put_grain(session, height, 0.0)
    mass = scene.sand.grain_mass_kg(2 * RADIUS_M, 2)
    weight = mass * scene.gravity_m_s2
    lowest, worst = height, 0.0
    for _ in range(2000):
        session.send("run 20")
        snapshot = session.snapshot()
        y, v = float(snapshot.position_m[0, 1]), float(snapshot.velocity_m_s[0, 1])
        overlap = max(0.0, RADIUS_M - y)
        energy = 0.5 * mass * v * v + weight * y + 0.5 * 2e4 * overlap**2
        worst = max(worst, abs(energy - weight * height) / (weight * 0.001))
        lowest = min(lowest, y)
    session.close()
    # Static sag doubled and the drop: 0.5 k u^2 = m g (drop + u).
    u = (weight + math.sqrt(weight**2 + 2 * 2e4 * weight * 0.001)) / 2e4
    assert RADIUS_M - lowest == pytest.approx(u, rel=2e-3)
    # Central differences keep a shadow energy: the wobble is (omega dt)^2 / 8 of the spring's.
    assert worst < 1e-4


@pytest.mark.parametrize("direction", ["vertical", [0.6, 0.8]])
@pytest.mark.parametrize("ramp_s", [0.0, 0.02])
def test_one_grain_moves_alike_in_both_frames(
    direction: object, ramp_s: float, tmp_path: Path
) -> None:
    stage = {
        "acceleration_g": 3.0,
        "frequency_hz": 50.0,
        "duration_s": 0.06,
        "direction": direction,
        "ramp_s": ramp_s,
    }
    tracks = []
    for frame in ("box", "laboratory"):
        scene = one_grain_scene(frame=frame, vibration=[stage], time_step={"fraction": 0.2})
        folder = tmp_path / frame
        folder.mkdir()
        session = open_lammps(scene, folder)
        put_grain(session, RADIUS_M, 0.0)
        session.start_stage(session._program.stages[-1])
        track = []
        while not session.stage_over:
            session.advance()
            snapshot = session.snapshot()
            track.append([*snapshot.position_m[0], *snapshot.velocity_m_s[0]])
        session.close()
        tracks.append(np.array(track))
    box, laboratory = tracks
    assert np.ptp(box[:, 1]) > 4e-4  # the grain was thrown, so there is something to compare
    # Round-off: the second difference of a displacement of 1e-4 m over dt^2 loses six digits.
    np.testing.assert_allclose(box, laboratory, atol=1e-9)


def test_grain_outside_the_simulation_box_is_a_lost_grain(tmp_path: Path) -> None:
    session = open_lammps(one_grain_scene(), tmp_path)
    put_grain(session, 0.01, 0.0)
    session.send("velocity all set 5000 0 0")
    with pytest.raises(EngineStop) as stop:
        session.send("run 20000")
    assert stop.value.outcome is Outcome.LOST_GRAINS
    assert "LAMMPS says" in stop.value.detail


def test_stage_of_vibration_lasts_whole_periods_and_a_step_at_either_end(tmp_path: Path) -> None:
    stage = {"acceleration_g": 1.0, "frequency_hz": 30.0, "duration_s": 0.1}
    scene = one_grain_scene(vibration=[stage], time_step={"fraction": 0.5})
    session = open_lammps(scene, tmp_path)
    put_grain(session, RADIUS_M, 0.0)
    last: Stage = session._program.stages[-1]
    session.start_stage(last)
    while not session.stage_over:
        session.advance()
    steps = session.steps
    session.close()
    assert steps == math.ceil(0.1 / scene.step_s) + 2
