"""What stops a run: shown on grains placed by hand."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from sandmould.engines.guard import Guard, grain_masses_kg, measure_health
from sandmould.engines.program import Stage
from sandmould.engines.session import EngineStop
from sandmould.engines.snapshot import Snapshot
from sandmould.runs.outcome import Outcome
from sandmould.scenario.stages import StageKind
from tests.scenes import tube_scene

R = 0.002
SCENE = tube_scene()
MASS_KG = 2400 * 0.1 * np.pi * R**2


def two_grains(overlap_m: float = 0.0, speed_m_s: float = 0.0) -> Snapshot:
    """Place two grains side by side, away from all walls."""
    position = np.array([[0.02, 0.02], [0.02 + 2 * R - overlap_m, 0.02]])
    velocity = np.array([[speed_m_s, 0.0], [0.0, 0.0]])
    one = np.ones(2, dtype=np.int64)
    return Snapshot(
        0.5, np.nan, "settle_1", np.array([1, 2]), one, position, velocity, np.zeros((2, 3)),
        np.full(2, R),
    )  # fmt: skip


def stopped_by(snapshot: Snapshot) -> EngineStop:
    """Give what the guard says of a snapshot."""
    guard = Guard(SCENE)
    guard.start_stage(Stage(StageKind.SETTLE, 1), two_grains())
    with pytest.raises(EngineStop) as stop:
        guard.check(snapshot)
    return stop.value


def test_health_of_two_grains() -> None:
    health = measure_health(SCENE, two_grains(overlap_m=0.1 * R, speed_m_s=2.0))
    assert grain_masses_kg(SCENE, two_grains()) == pytest.approx([MASS_KG, MASS_KG])
    assert health.kinetic_energy_j == pytest.approx(0.5 * MASS_KG * 4.0)
    assert health.rms_speed_m_s == pytest.approx(np.sqrt(2.0))
    assert health.largest_overlap_fraction == pytest.approx(0.1)


def test_overlap_with_a_wall_counts() -> None:
    grains = two_grains()
    at_floor = replace(grains, position_m=grains.position_m * [1, 0] + [0, 0.7 * R])
    assert measure_health(SCENE, at_floor).largest_overlap_fraction == pytest.approx(0.3)


def test_deep_overlap_stops() -> None:
    stop = stopped_by(two_grains(overlap_m=0.6 * R))
    assert stop.outcome is Outcome.OVERLAP_TOO_LARGE
    assert "0.6 of the smaller radius at 0.5 s in settle_1" in stop.detail


def test_number_that_is_none_stops() -> None:
    grains = two_grains()
    for name in ("position_m", "velocity_m_s"):
        stop = stopped_by(replace(grains, **{name: getattr(grains, name) * np.nan}))
        assert stop.outcome is Outcome.UNSTABLE
        assert "not a number" in stop.detail


def test_energy_beyond_the_fall_stops_and_just_below_does_not() -> None:
    # Both grains fall from their top, 0.022 m: M g h = (2 m) g h, the guard allows five times that.
    bound_j = 5 * 2 * MASS_KG * SCENE.gravity_m_s2 * (0.02 + R)
    limit_m_s = np.sqrt(2 * bound_j / MASS_KG)
    assert stopped_by(two_grains(speed_m_s=1.001 * limit_m_s)).outcome is Outcome.UNSTABLE
    guard = Guard(SCENE)
    guard.start_stage(Stage(StageKind.SETTLE, 1), two_grains())
    guard.check(two_grains(speed_m_s=0.999 * limit_m_s))


def test_vibration_raises_the_energy_bound() -> None:
    stage = Stage(StageKind.VIBRATE, 1, vibration=SCENE.vibration[0])
    guard = Guard(SCENE)
    guard.start_stage(stage, two_grains())
    wall = SCENE.vibration[0].amplitude_m * 2 * np.pi * 50
    bound_j = 5 * 2 * MASS_KG * (SCENE.gravity_m_s2 * (0.02 + R) + 2 * wall**2)
    guard.check(two_grains(speed_m_s=0.999 * np.sqrt(2 * bound_j / MASS_KG)))


@pytest.mark.parametrize("place", [(-0.001, 0.02), (0.02, -0.001), (0.06, 0.0365)])
def test_grain_behind_a_wall_or_in_a_plate_is_lost(place: tuple[float, float]) -> None:
    grains = two_grains()
    moved = replace(grains, position_m=np.array([grains.position_m[0], place]))
    stop = stopped_by(moved)
    assert stop.outcome is Outcome.LOST_GRAINS
    assert "grain 2" in stop.detail
