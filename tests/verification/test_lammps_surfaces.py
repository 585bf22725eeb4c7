"""Surfaces that LAMMPS takes from our kernels, against its own plates and a grain at rest."""

from __future__ import annotations

import math
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from sandmould.scenario.scenario import Scenario
from tests.scenes import open_lammps
from tests.verification.one_grain import (
    PLATE,
    RADIUS_M,
    SHAKE,
    SLAB,
    TOP_M,
    put_grain,
    slab_scene,
    track,
)

# Full critical damping LAMMPS can only come near to, by a restitution of 1e-100.
SMOOTH = {
    "grain_wall": {
        "normal_stiffness_n_m": 2e4,
        "friction": 0.0,
        "damping_ratio": 0.95,
        "rolling_arm_fraction": 0.0,
    }
}


def tracks(
    folder: Path,
    scenes: Sequence[Scenario],
    place: list[float],
    speed: list[float],
    windows: int,
    stage: int = 0,
) -> list[np.ndarray]:
    """Track the grain through a stage of each scene, from the same place at the same speed."""
    found = []
    for number, scene in enumerate(scenes):
        there = folder / f"scene_{number}"
        there.mkdir()
        session = open_lammps(scene, there)
        put_grain(session, place, speed)
        session.start_stage(session._program.stages[stage])
        found.append(track(session, windows))
        session.close()
    return found


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


def test_polygon_without_friction_equals_a_plate_of_lammps(tmp_path: Path) -> None:
    scenes = [slab_scene(obstacle, contact=SMOOTH) for obstacle in (PLATE, SLAB)]
    plate, polygon = tracks(tmp_path, scenes, [0.018, TOP_M + RADIUS_M * 1.1], [0.3, -0.2], 400)
    assert plate[-1, 0] > 0.029  # over two joints
    assert plate[:, -1].min() < -0.5  # and pressed on the slab
    np.testing.assert_allclose(polygon, plate, rtol=1e-9, atol=1e-12)


def test_friction_on_a_polygon_equals_that_on_a_plate_while_the_grain_slides(
    tmp_path: Path,
) -> None:
    scenes = [slab_scene(obstacle) for obstacle in (PLATE, SLAB)]
    plate, polygon = tracks(tmp_path, scenes, [0.018, TOP_M + RADIUS_M * 0.999], [0.6, 0.0], 100)
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
    scenes = [
        slab_scene(obstacle, contact=SMOOTH, frame=frame, vibration=[SHAKE])
        for obstacle in (PLATE, SLAB)
    ]
    over = [0.023, TOP_M + RADIUS_M]
    plate, polygon = tracks(tmp_path, scenes, over, [0.0, 0.0], 10_000, stage=1)
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
    soft = {"normal_stiffness_n_m": 500.0, "tangential_stiffness_n_m": 500.0}
    contact = {
        "grain_grain": soft,
        "grain_wall": SMOOTH["grain_wall"] | soft,
        "springs_at_size_scale": None,
    }
    scenes = [
        slab_scene(obstacle, dimension=3, box=box, contact=contact)
        for obstacle in ({**plate, "size_m": [0.04, 0.04, 0.005]}, other)
    ]
    over = [0.02, 0.022, TOP_M + RADIUS_M * 1.1]
    own, ours = tracks(tmp_path, scenes, over, [0.2, 0.1, -0.2], 200)
    assert own[:, -1].min() < -1e-3
    # The file keeps single precision: lengths to 6e-8 of themselves.
    tolerance = 1e-9 if kind == "cylinder" else 1e-5
    scale = np.abs(own).max(axis=0)
    assert (np.abs(ours - own).max(axis=0) <= tolerance * scale + 1e-12).all()


def test_a_grain_rests_in_a_notch_on_both_its_sides(tmp_path: Path) -> None:
    notch = {
        "kind": "polygon",
        "name": "slab",
        "vertices_m": [[0.0, 0.005], [0.05, 0.005], [0.05, 0.02], [0.025, 0.01], [0.0, 0.02]],
    }
    quiet = {"rest": {"rms_speed_m_s": 1e-5, "check_every_s": 1e-4, "load_every_steps": 1}}
    quiet["fill"] = {"layers": [{"count": 1}], "settling": {"shortest_s": 0.1}}
    session = open_lammps(slab_scene(notch, contact=SMOOTH, **quiet), tmp_path)
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
