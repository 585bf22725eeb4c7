"""Shells of one STL that touch or overlap are one solid; a shell drawn inwards is a cavity."""

from __future__ import annotations

import math
from collections.abc import Sequence
from pathlib import Path

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from sandmould.analysis.free_space import sphere_mesh_m3
from sandmould.casting.arpm.raster import painted
from sandmould.geometry.drawing_file import MeshFileError
from sandmould.geometry.geometry import Block
from sandmould.geometry.mesh import TriangleMesh
from sandmould.geometry.mesh_file import read_drawing, read_surface
from tests.unit.geometry.test_mesh_file import write_stl
from tests.unit.meshes import CORNERS, FACETS

RNG = np.random.default_rng(11)
Part = tuple[np.ndarray, np.ndarray]


def box(low: Sequence[float], high: Sequence[float], inwards: bool = False) -> Part:
    corners = np.array(low) + CORNERS * (np.array(high) - np.array(low))
    return corners, FACETS[:, ::-1] if inwards else FACETS


def turned(seed: int, side: float, centre: Sequence[float]) -> tuple[Part, Block]:
    axes = Rotation.random(random_state=seed).as_matrix()
    block = Block("box", np.array(centre), np.full(3, side / 2), axes)
    return (block.corners(), block.facets()), block


def file_of(parts: Sequence[Part], folder: Path) -> Path:
    starts = np.cumsum([0, *(len(vertices) for vertices, _ in parts)])
    vertices = np.concatenate([vertices for vertices, _ in parts])
    facets = [facets + start for (_, facets), start in zip(parts, starts, strict=False)]
    return write_stl(folder / "parts.stl", vertices, np.concatenate(facets))


def mesh_of(parts: Sequence[Part], folder: Path) -> TriangleMesh:
    return TriangleMesh("parts", *read_surface(file_of(parts, folder)))


CUBE = box([4, 4, 4], [24, 24, 24])
SCENES: dict[str, tuple[list[Part], int]] = {
    "part of a face": ([CUBE, box([24, 8, 8], [44, 20, 20])], 1360),
    "flush with a corner": ([CUBE, box([24, 4, 4], [44, 16, 16])], 1360),
    "a whole face": ([CUBE, box([24, 4, 4], [44, 24, 24])], 2000),
    "an edge": ([CUBE, box([24, 24, 4], [44, 44, 24])], 2000),
    "overlap": ([CUBE, box([20, 8, 8], [44, 20, 20])], 1360),
    "overlap with flush sides": ([CUBE, box([20, 4, 4], [44, 16, 16])], 1360),
    "the second drawn inside out": ([CUBE, box([24, 8, 8], [44, 20, 20], True)], 1360),
    "apart": ([CUBE, box([28, 8, 8], [48, 20, 20])], 1360),
    "one in the other": ([CUBE, box([8, 8, 8], [16, 16, 16])], 1000),
    "hollow": ([CUBE, box([8, 8, 8], [20, 20, 20], True)], 784),
    "hollow, all inside out": ([box([4, 4, 4], [24, 24, 24], True), box([8, 8, 8], [20] * 3)], 784),
    "hollow and bridged": (
        [CUBE, box([8, 8, 8], [20, 20, 20], True), box([6, 10, 10], [22, 14, 14])], 784 + 24,
    ),
}  # fmt: skip


@pytest.mark.parametrize("name", SCENES)
def test_cells_of_parts_that_touch_or_overlap(name: str, tmp_path: Path) -> None:
    parts, cells = SCENES[name]
    mesh = mesh_of(parts, tmp_path)
    raster = painted(np.zeros(3), np.full(3, 52.0), 2.0, {1: mesh})
    assert raster.material.sum() == cells
    # the vertices lie on the grid, so that volume and signs are those of the cells
    assert mesh.measure == pytest.approx(8.0 * cells, rel=1e-6)
    inside = raster.material.ravel() == 1
    distance = mesh.distance_m(raster.centre_m)
    np.testing.assert_array_equal(distance < 0.0, inside)


def test_distance_and_parts_of_spheres_are_those_of_the_union(tmp_path: Path) -> None:
    """Nothing inside is felt, neither by a grain in reach nor by a measure of volume."""
    mesh = mesh_of([CUBE, box([20, 4, 4], [44, 16, 16])], tmp_path)
    blocks = [Block("a", np.full(3, 14.0), np.full(3, 10.0), np.eye(3)),
              Block("b", np.array([32.0, 10, 10]), np.array([12.0, 6, 6]), np.eye(3))]  # fmt: skip
    point = RNG.uniform(0.0, 50.0, (3000, 3))
    expected = np.min([block.distance_m(point) for block in blocks], axis=0)
    outside = expected > 0.0
    np.testing.assert_allclose(mesh.distance_m(point)[outside], expected[outside], atol=1e-5)
    # in the middle of the cut only the sides are near: 6 below z = 16 and 4 above the bottom
    middle = np.array([[22.0, 10.0, 10.0]])
    assert mesh.distance_m(middle)[0] == pytest.approx(-6.0)
    whole = 4.0 / 3.0 * np.pi * 5.0**3
    assert sphere_mesh_m3(middle, np.array([5.0]), mesh)[0] == pytest.approx(whole)
    spheres, _ = mesh.near_triangles(middle, np.array([5.9]))
    assert not len(spheres)


@pytest.mark.parametrize("seed", range(6))
def test_boxes_that_cross_anyhow(seed: int, tmp_path: Path) -> None:
    scenes = [turned(seed, 1.0, [0, 0, 0]), turned(seed + 50, 0.8, [0.5, 0.2, 0.1]),
              turned(seed + 90, 0.7, [-0.3, 0.3, 0.4])]  # fmt: skip
    mesh = mesh_of([part for part, _ in scenes], tmp_path)
    point = RNG.uniform(-1.2, 1.2, (4000, 3))
    expected = np.min([block.distance_m(point) for _, block in scenes], axis=0)
    clear = np.abs(expected) > 1e-5
    np.testing.assert_array_equal(mesh.holds(point)[clear], expected[clear] < 0.0)
    outside = expected > 0.0
    np.testing.assert_allclose(mesh.distance_m(point)[outside], expected[outside], atol=1e-5)


def test_gap_below_the_tolerance_is_none(tmp_path: Path) -> None:
    """A millionth of the extent is one place: seven digits tell no more."""
    mesh = mesh_of([CUBE, box([24 + 1e-5, 8, 8], [44, 20, 20])], tmp_path)
    assert mesh.measure == pytest.approx(8.0 * 1360, rel=1e-5)
    assert len(mesh.section_m(2, 14.0)) == 1
    apart = mesh_of([CUBE, box([24.01, 8, 8], [44, 20, 20])], tmp_path)
    assert len(apart.section_m(2, 14.0)) == 2


OBLIQUE: dict[str, tuple[list[Part], float, float]] = {
    "part of a face": (SCENES["part of a face"][0], 10880, 3360),
    "flush with a corner": (SCENES["flush with a corner"][0], 10880, 3360),
    "an edge": (SCENES["an edge"][0], 16000, 4800),
    "overlap": (SCENES["overlap"][0], 10880, 3360),
    "hollow and bridged": (SCENES["hollow and bridged"][0], 6464, 3424),
    "cavities that touch": (
        [CUBE, box([8, 8, 8], [14, 14, 14], True), box([14, 10, 10], [20, 20, 20], True)],
        7184,
        3024,
    ),
    "cavity open to a side": ([CUBE, box([8, 8, 8], [14, 14, 24], True)], 7424, 2784),
    "cavity in two that touch": (
        [CUBE, box([24, 4, 4], [44, 24, 24]), box([20, 8, 8], [30, 20, 20], True)],
        14560,
        4768,
    ),
    "cavity that the second solid fills": (
        [CUBE, box([14, 4, 4], [44, 24, 24]), box([16, 8, 8], [20, 20, 20], True)],
        16000,
        4000,
    ),
    "solid in a cavity, hollow itself": (
        [
            CUBE,
            box([6, 6, 6], [22, 22, 22], True),
            box([8, 8, 8], [20, 20, 20]),
            box([10, 10, 10], [18, 18, 18], True),
        ],
        5120,
        2400 + 1536 + 864 + 384,
    ),
}


@pytest.mark.parametrize("seed", [None, 0, 1, 2])
@pytest.mark.parametrize("name", OBLIQUE)
def test_volume_and_area_of_a_union_turned_anyhow(
    name: str, seed: int | None, tmp_path: Path
) -> None:
    """Rounding tears oblique faces that touch apart, and leaves slivers where they are flush."""
    parts, volume, area = OBLIQUE[name]
    axes = np.eye(3) if seed is None else Rotation.random(random_state=seed).as_matrix()
    mesh = mesh_of([(vertices @ axes.T, facets) for vertices, facets in parts], tmp_path)
    exact = 1e-12 if seed is None else 2e-7
    assert mesh.measure == pytest.approx(volume, rel=exact)
    assert double_areas(mesh).sum() / 2.0 == pytest.approx(area, rel=exact)
    assert least_angles_deg(mesh).min() > 0.11  # LIGGGHTS refuses half of it


@pytest.mark.parametrize("name", ["apart", "one in the other", "hollow"])
def test_shells_that_meet_nowhere_stay_as_they_are_drawn(name: str, tmp_path: Path) -> None:
    parts, _ = SCENES[name]
    stay = parts[:1] if name == "one in the other" else parts
    drawn = np.concatenate([vertices[facets] for vertices, facets in stay])
    np.testing.assert_array_equal(mesh_of(parts, tmp_path).corners_m, drawn)


def test_cavity_that_sticks_out_is_refused(tmp_path: Path) -> None:
    with pytest.raises(MeshFileError, match="shells that face inwards only where they are cav"):
        mesh_of([CUBE, box([20, 8, 8], [44, 20, 20], True)], tmp_path)


def test_shell_that_changes_nothing_is_counted(tmp_path: Path) -> None:
    assert read_drawing(file_of(SCENES["one in the other"][0], tmp_path)).filled_shells == 1
    assert read_drawing(file_of(SCENES["hollow"][0], tmp_path)).filled_shells == 0


def test_union_has_no_narrower_triangles_than_its_parts(tmp_path: Path) -> None:
    """Lines of a fan across a lid left triangles of 0.06 degrees, which LIGGGHTS refuses."""
    mesh = mesh_of([CUBE, cylinder(40, 6, [14, 14, 19], 15), cylinder(30, 3, [14, 14, 21], 25)],
                   tmp_path)  # fmt: skip
    assert least_angles_deg(mesh).min() > 0.5
    discs = 20 * math.sin(2 * math.pi / 40) * 36, 15 * math.sin(2 * math.pi / 30) * 9
    assert mesh.measure == pytest.approx(8000 + 10 * discs[0] + 12 * discs[1], rel=1e-5)


def double_areas(mesh: TriangleMesh) -> np.ndarray:
    a, b, c = mesh.corners_m.transpose(1, 0, 2)
    return np.linalg.norm(np.cross(b - a, c - a), axis=1)


def least_angles_deg(mesh: TriangleMesh) -> np.ndarray:
    a, b, c = mesh.corners_m.transpose(1, 0, 2)
    sides = np.sort([np.linalg.norm(e, axis=1) for e in (b - a, c - b, a - c)], axis=0)
    return np.degrees(np.arcsin(double_areas(mesh) / (sides[1] * sides[2])))


def cylinder(sides: int, radius: float, low: Sequence[float], height: float) -> Part:
    angle = 2 * np.pi * np.arange(sides) / sides
    ring = np.column_stack([radius * np.cos(angle), radius * np.sin(angle), np.zeros(sides)])
    ends = np.array([[0, 0, 0], [0, 0, height]])
    k, following, n = np.arange(sides), (np.arange(sides) + 1) % sides, sides
    fans = [
        [k, following, n + following],
        [k, n + following, n + k],
        [np.full(n, 2 * n), following, k],
        [np.full(n, 2 * n + 1), n + k, n + following],
    ]
    facets = np.concatenate([np.stack(fan, axis=1) for fan in fans])
    return np.concatenate([ring, ring + ends[1], ends]) + np.array(low), facets
