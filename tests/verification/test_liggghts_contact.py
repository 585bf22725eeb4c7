"""LIGGGHTS's contact laws against exact results."""

from __future__ import annotations

import math
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from sandmould.engines.guard import grain_masses_kg
from sandmould.scenario.scenario import Scenario
from tests.liggghts_scenes import (
    RADIUS_M,
    WALL_SPRINGS,
    needs_liggghts,
    one_grain_scene,
    open_liggghts,
    put_grain,
)
from tests.verification.test_single_contact import exact_restitution, law

pytestmark = needs_liggghts


@pytest.mark.parametrize("no_tension", ["total", "elastic"])
@pytest.mark.parametrize(
    ("dimension", "damping_ratio"),
    [(2, 0.05), (2, 0.3), (2, 0.7), (2, 0.95), (2, 1.0), (3, 0.3), (3, 1.0)],
)
def test_restitution_equals_the_exact_value(
    damping_ratio: float, no_tension: str, dimension: int, tmp_path: Path
) -> None:
    contact = {**law(damping_ratio), "no_tension": no_tension}
    scene = one_grain_scene(dimension=dimension, contact=contact, gravity_m_s2=0.0)
    session = open_liggghts(scene, tmp_path)
    put_grain(session, RADIUS_M * 1.001, [0.0] * (dimension - 1) + [-0.1])
    period = 2 * math.pi * math.sqrt(scene.sand.grain_mass_kg(2 * RADIUS_M, dimension) / 2e4)
    # A critically damped contact that may pull never ends: three periods are as good as for ever.
    session.send(f"run {math.ceil((3 * period + 2 * RADIUS_M * 0.001 / 0.1) / scene.step_s)}")
    rebound = float(session.snapshot().velocity_m_s[0, -1]) / 0.1
    session.close()
    # As in LAMMPS, the dashpot sees the velocity half a step late.
    assert rebound == pytest.approx(exact_restitution(damping_ratio, no_tension), abs=3e-4)


def pair_scene(damping_ratio: float, **changes: Any) -> Scenario:
    """Two classes of sand, one grain of each, without gravity."""
    sieve = [
        {"opening_m": d, "passing_fraction": p} for d, p in ((2e-3, 0), (3e-3, 0.2), (5e-3, 1))
    ]
    contact = {"grain_grain": {"damping_ratio": damping_ratio, "friction": 0.0}}
    return one_grain_scene(
        sand={"sieve": sieve, "size_classes": 2},
        fill={"layers": [{"count": 2}]},
        contact=contact,
        gravity_m_s2=0.0,
        **changes,
    )


@pytest.mark.parametrize("damping_ratio", [0.05, 0.7])
def test_restitution_of_unequal_grains_is_that_of_the_law(
    damping_ratio: float, tmp_path: Path
) -> None:
    scene = pair_scene(damping_ratio)
    session = open_liggghts(scene, tmp_path)
    session.insert_layer(1)
    before = session.snapshot()
    radius = before.radius_m
    assert radius[0] != radius[1]
    apart = radius.sum() * 1.0005
    place = np.array([[0.02, 0.006], [0.02 + apart, 0.006]])
    session.set_state(place, np.array([[0.1, 0.0], [0.0, 0.0]]), np.zeros((2, 3)))
    session.send("run 20000")
    after = session.snapshot().velocity_m_s[:, 0]
    session.close()
    assert (after[1] - after[0]) / 0.1 == pytest.approx(
        exact_restitution(damping_ratio, "total"), abs=3e-4
    )
    mass = grain_masses_kg(scene, before)
    assert after @ mass == pytest.approx(0.1 * mass[0], rel=1e-12)


@pytest.mark.parametrize("dimension", [2, 3])
def test_sliding_grain_starts_to_roll_at_five_sevenths_of_its_speed(
    dimension: int, tmp_path: Path
) -> None:
    wall = {**WALL_SPRINGS, "friction": 0.35, "rolling_arm_fraction": 0.0}
    scene = one_grain_scene(
        dimension=dimension, contact={"grain_wall": wall}, time_step={"fraction": 0.1}
    )
    session = open_liggghts(scene, tmp_path)
    sag = scene.sand.grain_mass_kg(2 * RADIUS_M, dimension) * scene.gravity_m_s2 / 2e4
    put_grain(session, RADIUS_M - sag, [0.1, *[0.0] * (dimension - 1)])
    slides_s = 2 / 7 * 0.1 / (0.35 * scene.gravity_m_s2)
    session.send(f"run {math.ceil(0.5 * slides_s / scene.step_s)}")
    half = session.snapshot().velocity_m_s[0, 0]
    session.send(f"run {math.ceil(2 * slides_s / scene.step_s)}")
    rolls = session.snapshot().velocity_m_s[0, 0]
    session.close()
    assert half == pytest.approx(6 / 7 * 0.1, rel=2e-3)
    # The moment of inertia is 2/5 m r^2, also of a disc; the tangential spring keeps a swing.
    assert rolls == pytest.approx(5 / 7 * 0.1, rel=5e-3)


@pytest.mark.parametrize("dimension", [2, 3])
def test_rolling_grain_slows_down_by_the_moment_of_its_arm(dimension: int, tmp_path: Path) -> None:
    arm = 0.02
    wall = {**WALL_SPRINGS, "friction": 0.35, "rolling_arm_fraction": arm}
    scene = one_grain_scene(
        dimension=dimension, contact={"grain_wall": wall}, time_step={"fraction": 0.5}
    )
    session = open_liggghts(scene, tmp_path)
    sag = scene.sand.grain_mass_kg(2 * RADIUS_M, dimension) * scene.gravity_m_s2 / 2e4
    put_grain(session, RADIUS_M - sag, [0.1, *[0.0] * (dimension - 1)], 0.1 / (RADIUS_M - sag))
    session.send(f"run {math.ceil(0.2 / scene.step_s)}")
    slowed = 0.1 - session.snapshot().velocity_m_s[0, 0]
    session.close()
    # Moment f N about the contact: (I + m r^2) dw/dt = f r m g with I = 2/5 m r^2.
    assert slowed == pytest.approx(arm * scene.gravity_m_s2 / 1.4 * 0.2, rel=0.01)


@pytest.mark.parametrize("dimension", [2, 3])
def test_grain_bounces_straight_off_a_corner(dimension: int, tmp_path: Path) -> None:
    plate = {"kind": "plate", "centre_m": [0.02] * dimension, "size_m": [0.01] * dimension}
    scene = one_grain_scene(
        dimension=dimension,
        obstacles=[plate],
        contact={**law(0.0), "grain_grain": WALL_SPRINGS},
        gravity_m_s2=0.0,
        time_step={"fraction": 0.05},
    )
    session = open_liggghts(scene, tmp_path)
    session.insert_layer(1)
    outwards = np.array([[0.3, 0.8], [0.3, 0.5, 0.8]][dimension - 2])
    outwards /= np.linalg.norm(outwards)
    place = np.full(dimension, 0.025) + 1.001 * RADIUS_M * outwards
    session.set_state(place[None], -0.1 * outwards[None], np.zeros((1, 3)))
    mass = scene.sand.grain_mass_kg(2 * RADIUS_M, dimension)
    session.send(f"run {math.ceil(2 * math.pi * math.sqrt(mass / 2e4) / scene.step_s)}")
    rebound = session.snapshot().velocity_m_s[0]
    session.close()
    np.testing.assert_allclose(rebound, 0.1 * outwards, atol=1e-6)
