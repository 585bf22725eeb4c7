"""Drawings of ten programs and with twelve kinds of damage: read with their volume, or refused."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from sandmould.geometry.drawing_file import MeshFileError, tells_unit
from sandmould.geometry.mesh import TriangleMesh
from sandmould.geometry.mesh_coarser import MANY, WITHIN
from sandmould.geometry.mesh_file import read_drawing
from tests.drawings import BODIES, DAMAGES, PROGRAMS, REFUSED, binary, written


def _volume_mm3(path: Path) -> float:
    read = read_drawing(path)
    unit = 1e9 if tells_unit(path) else 1.0
    return unit * TriangleMesh("read", read.vertices, read.triangles).measure


@pytest.mark.parametrize("body", BODIES)
@pytest.mark.parametrize("program", PROGRAMS)
def test_drawings_of_programs_are_read_as_they_are(program: str, body: str, tmp_path: Path) -> None:
    (mesh, volume), (ending, write) = BODIES[body], PROGRAMS[program]
    path = written(tmp_path / f"part{ending}", write(mesh))
    # single precision in binary files, eight digits in texts
    assert _volume_mm3(path) == pytest.approx(volume, rel=1e-6)
    done = read_drawing(path).mended
    assert (done.dropped, done.joined, done.holes) == (0, 0, 0)
    assert len(read_drawing(path).triangles) == len(mesh[1])


@pytest.mark.parametrize("body", BODIES)
@pytest.mark.parametrize("damage", DAMAGES)
def test_damage_with_one_cure_is_mended(damage: str, body: str, tmp_path: Path) -> None:
    mesh, volume = BODIES[body]
    path = written(tmp_path / "part.stl", binary(DAMAGES[damage](mesh)))
    read = read_drawing(path)
    # a crack of 0.0005 mm moves a triangle by that; all else is exact but for single precision
    assert _volume_mm3(path) == pytest.approx(volume, rel=1e-4 if damage == "crack" else 1e-6)
    done = read.mended
    told = (done.dropped, done.joined > 0, done.holes, read.turned_triangles)
    assert (
        told
        == {
            "one_missing": (0, False, 1, 0),
            "one_turned": (0, False, 0, 1),
            "inside_out": (0, False, 0, len(mesh[1])),
            "drawn_twice": (1, False, 0, 0),
            "no_area": (2, False, 0, 0),
            "point_on_an_edge": (0, True, 0, 0),
            "crack": (0, True, 0, 0),
            "sheet": (2, False, 0, 0),
        }[damage]
    )


@pytest.mark.parametrize("body", BODIES)
@pytest.mark.parametrize("damage", REFUSED)
def test_what_cannot_be_mended_is_refused_with_its_place(
    damage: str, body: str, tmp_path: Path
) -> None:
    write, says = REFUSED[damage]
    with pytest.raises(MeshFileError, match=says):
        read_drawing(written(tmp_path / "part.stl", write(BODIES[body][0])))


def _open_sphere(path: Path, below: float) -> tuple[float, Path]:
    """Volume of a sphere, and a file of it without the triangles above a height."""
    sphere = _sphere(6.0, 24)
    left = sphere.corners_m.mean(axis=1)[:, 2] < below
    return sphere.measure, written(path, binary((sphere.vertices_m, sphere.triangles[left])))


def test_what_a_hole_leaves_unknown_is_no_less_than_what_it_lacks(tmp_path: Path) -> None:
    volume, path = _open_sphere(tmp_path / "open.stl", 5.8)
    lacks = volume - _volume_mm3(path)
    assert 0.0 < lacks < read_drawing(path).mended.unknown_volume < 0.01 * volume


def test_a_hole_that_leaves_too_much_unknown_is_refused(tmp_path: Path) -> None:
    # 30 degrees round the pole lack 1.3 % of a sphere
    _, path = _open_sphere(tmp_path / "open.stl", 5.2)
    with pytest.raises(MeshFileError, match=r"the holes of this one leave 1.\d% of its volume un"):
        read_drawing(path)


def test_many_triangles_are_merged_within_the_stated_distance(tmp_path: Path) -> None:
    sphere = _sphere(25.0, 110)
    assert len(sphere.triangles) > 2 * MANY
    path = written(tmp_path / "round.stl", binary((sphere.vertices_m, sphere.triangles)))
    read = read_drawing(path)
    coarse = TriangleMesh("coarse", read.vertices, read.triangles)
    assert len(coarse.triangles) <= MANY
    assert read.within == pytest.approx(WITHIN * 50.0, rel=1e-3)
    places = np.concatenate([sphere.vertices_m, sphere.corners_m.mean(axis=1)])
    assert np.abs(coarse.distance_m(places)).max() <= read.within
    assert np.abs(sphere.distance_m(coarse.corners_m.mean(axis=1))).max() <= read.within
    for of in ("measure", "surface_m2"):
        assert getattr(coarse, of) == pytest.approx(getattr(sphere, of), rel=1e-3)


def _sphere(radius: float, rows: int) -> TriangleMesh:
    """A sphere of rows of triangles between parallels, and fans at its poles."""
    sides = 2 * rows
    polar = np.pi * np.arange(1, rows) / rows
    turn = 2.0 * np.pi * np.arange(sides) / sides
    ring = np.stack(
        [np.outer(np.sin(polar), np.cos(turn)), np.outer(np.sin(polar), np.sin(turn)),
         np.outer(np.cos(polar), np.ones(sides))], axis=2,
    ).reshape(-1, 3)  # fmt: skip
    vertices = radius * np.concatenate([ring, [[0, 0, 1], [0, 0, -1]]])
    k, after = np.arange(sides), (np.arange(sides) + 1) % sides
    top, bottom = len(ring), len(ring) + 1
    parts = [np.column_stack([np.full(sides, top), k, after])]
    for row in range(rows - 2):
        a, b = row * sides, (row + 1) * sides
        parts.append(np.column_stack([a + k, b + k, b + after]))
        parts.append(np.column_stack([a + k, b + after, a + after]))
    last = (rows - 2) * sides
    parts.append(np.column_stack([np.full(sides, bottom), last + after, last + k]))
    return TriangleMesh("sphere", vertices, np.concatenate(parts))
