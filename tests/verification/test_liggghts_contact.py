"""LIGGGHTS's corners of meshes; its contact laws are among the cases of ``test_cases.py``."""

from __future__ import annotations

import math
from pathlib import Path

import numpy as np
import pytest

from tests.liggghts_scenes import (
    RADIUS_M,
    WALL_SPRINGS,
    needs_liggghts,
    one_grain_scene,
    open_liggghts,
)

pytestmark = needs_liggghts
SMOOTH = {
    "normal_stiffness_n_m": 2e4,
    "damping_ratio": 0.0,
    "friction": 0.0,
    "rolling_arm_fraction": 0.0,
}


@pytest.mark.parametrize("dimension", [2, 3])
def test_grain_bounces_straight_off_a_corner(dimension: int, tmp_path: Path) -> None:
    plate = {"kind": "plate", "centre_m": [0.02] * dimension, "size_m": [0.01] * dimension}
    scene = one_grain_scene(
        dimension=dimension,
        obstacles=[plate],
        contact={"grain_wall": SMOOTH, "grain_grain": WALL_SPRINGS},
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
