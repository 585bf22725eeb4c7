"""Hollows of a part: what its convex hull holds and the part does not, by exact volumes."""

from __future__ import annotations

from pathlib import Path

import meshio
import numpy as np
import pytest

from sandmould.bad_input import BadInputError
from sandmould.geometry.mesh import TriangleMesh
from sandmould.scenario.cavities import MeshCavity, cavity_space
from sandmould.scenario.hollows import hollows
from tests.unit.meshes import CORNERS, FACETS

Places = list[tuple[float, float]]
SLOT: Places = [(0, 0), (50, 0), (50, 42), (0, 42), (0, 36), (44, 36), (44, 6), (0, 6)]
SLOT_ENDS = [(0, 1, 6), (0, 6, 7), (1, 2, 5), (1, 5, 6), (2, 3, 4), (2, 4, 5)]
UNDERCUT: Places = [
    (0, 0), (50, 0), (50, 40), (40, 40), (40, 20), (45, 20), (45, 10), (5, 10), (5, 20), (30, 20),
    (30, 40), (0, 40),
]  # fmt: skip
UNDERCUT_ENDS = [
    (0, 1, 6), (0, 6, 7), (0, 7, 8), (0, 8, 11), (8, 9, 11), (9, 10, 11), (1, 2, 5), (1, 5, 6),
    (2, 3, 4), (2, 4, 5),
]  # fmt: skip


def drawn_out(outline: Places, ends: list[tuple[int, int, int]]) -> TriangleMesh:
    """A solid of an outline in x and z, 60 deep."""
    n = len(outline)
    vertices = [(x, y, z) for y in (0.0, 60.0) for x, z in outline]
    triangles = [*ends, *((c + n, b + n, a + n) for a, b, c in ends)]
    for i in range(n):
        j = (i + 1) % n
        triangles += [(j, i, i + n), (j, i + n, j + n)]
    return TriangleMesh("part", np.array(vertices), np.array(triangles))


def volumes(part: TriangleMesh) -> list[float]:
    return [it.measure for it in hollows(part.vertices_m, part.triangles)]


def test_a_slot_and_a_hole_with_an_undercut_are_found_whole() -> None:
    assert volumes(drawn_out(SLOT, SLOT_ENDS)) == pytest.approx([44 * 30 * 60], rel=1e-9)
    undercut = drawn_out(UNDERCUT, UNDERCUT_ENDS)
    assert volumes(undercut) == pytest.approx([60 * (40 * 10 + 10 * 20)], rel=1e-9)


def test_a_closed_hole_is_one_and_a_convex_part_has_none() -> None:
    hole = TriangleMesh("hole", 0.25 + 0.5 * CORNERS, FACETS[:, ::-1])
    vertices = np.concatenate([CORNERS, hole.vertices_m])
    assert volumes(
        TriangleMesh("part", vertices, np.concatenate([FACETS, hole.triangles + 8]))
    ) == (pytest.approx([0.125], rel=1e-9))
    assert not hollows(CORNERS, FACETS)


def test_a_cavity_is_the_hollow_of_the_file_of_its_part(tmp_path: Path) -> None:
    part = drawn_out(SLOT, SLOT_ENDS)
    file = tmp_path / "block.stl"
    meshio.Mesh(part.vertices_m, [("triangle", part.triangles)]).write(file)
    told = {"kind": "mesh", "name": "slot", "file": str(file), "unit_m": 0.001, "opens": "left"}
    slot = cavity_space(
        MeshCavity(**told, hollow=1, position_m=(0.05, 0.0, 0.025)), 3, "cavities.0"
    )
    corners_m = slot.space.corners()
    np.testing.assert_allclose(corners_m.min(axis=0), [0.05, 0.0, 0.031], atol=1e-9)
    np.testing.assert_allclose(corners_m.max(axis=0), [0.094, 0.06, 0.061], atol=1e-9)
    with pytest.raises(BadInputError, match=r"1 to 1: the hollows of this part hold 79.2 cm3"):
        cavity_space(MeshCavity(**told, hollow=2), 3, "cavities.0")
