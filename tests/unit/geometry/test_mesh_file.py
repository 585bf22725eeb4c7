"""STL files: closed surfaces are read and turned outwards, all others are refused."""

from __future__ import annotations

import shutil
from dataclasses import replace
from pathlib import Path

import meshio
import numpy as np
import pytest

from sandmould.geometry import mesh_file
from sandmould.geometry.drawing_file import MeshFileError
from sandmould.geometry.mesh import TriangleMesh
from sandmould.geometry.mesh_file import read_surface
from sandmould.limits import TRIANGLES
from tests.bracket import BRACKET
from tests.fuzz.readers import CORPUS
from tests.unit.meshes import CORNERS, CUBE, FACETS, SHIPPED

RNG = np.random.default_rng(5)


def write_stl(path: Path, vertices: np.ndarray, triangles: np.ndarray, binary: bool = True) -> Path:
    meshio.stl.write(str(path), meshio.Mesh(vertices, [("triangle", triangles)]), binary=binary)
    return path


def test_shipped_bracket_is_what_its_script_writes() -> None:
    vertices, triangles = read_surface(BRACKET)
    mesh = TriangleMesh("bracket", vertices, triangles)
    assert (len(vertices), len(triangles)) == (308, 612)
    assert mesh.measure == pytest.approx(SHIPPED.measure, rel=1e-6)
    assert np.abs(SHIPPED.distance_m(mesh.vertices_m)).max() < 1e-5


@pytest.mark.parametrize("binary", [True, False])
def test_stl_of_either_kind_faces_outwards(tmp_path: Path, binary: bool) -> None:
    for facets in (FACETS, FACETS[:, ::-1]):
        path = write_stl(tmp_path / "cube.stl", CORNERS, facets, binary)
        vertices, triangles = read_surface(path)
        assert len(vertices) == 8
        assert TriangleMesh("cube", vertices, triangles).measure == pytest.approx(1.0)


def test_vertices_that_round_off_keeps_apart_are_one(tmp_path: Path) -> None:
    loose = CORNERS[FACETS].reshape(-1, 3) + RNG.uniform(-2e-7, 2e-7, (36, 3))
    path = write_stl(tmp_path / "cube.stl", loose, np.arange(36).reshape(-1, 3))
    assert len(read_surface(path)[0]) == 8


def test_cavity_faces_inwards_and_a_second_solid_outwards(tmp_path: Path) -> None:
    inner, beside = 0.25 + 0.5 * CORNERS, CORNERS + np.array([3, 0, 0])
    vertices = np.concatenate([CORNERS, inner, beside])
    facets = np.concatenate([FACETS, FACETS[:, ::-1] + 8, FACETS[:, ::-1] + 16])
    mesh = TriangleMesh("two", *read_surface(write_stl(tmp_path / "two.stl", vertices, facets)))
    assert mesh.measure == pytest.approx(1 - 0.125 + 1)
    np.testing.assert_array_equal(
        mesh.distance_m(np.array([[0.5, 0.5, 0.5], [0.1, 0.5, 0.5], [3.5, 0.5, 0.5]])) < 0,
        [False, True, True],
    )


def test_solids_that_meet_in_a_vertex(tmp_path: Path) -> None:
    vertices = np.concatenate([CORNERS, CORNERS - 1])
    facets = np.concatenate([FACETS, FACETS[:, ::-1] + 8])
    mesh = TriangleMesh("two", *read_surface(write_stl(tmp_path / "two.stl", vertices, facets)))
    assert len(mesh.vertices_m) == 16
    assert mesh.measure == pytest.approx(2.0)
    point = RNG.uniform(-0.4, 0.4, (500, 3))
    expected = np.minimum(CUBE.distance_m(point), CUBE.distance_m(point + 1))
    np.testing.assert_allclose(mesh.distance_m(point), expected, atol=1e-7)


NOWHERE = CORNERS.copy()
NOWHERE[0, 0] = np.nan
FAULTS: dict[str, tuple[np.ndarray, np.ndarray, str]] = {
    "open": (CORNERS, FACETS[2:], "a closed surface; 1 hole in this one is 17% of it, one at ("),
    "a sheet": (
        np.concatenate([CORNERS, [[0.5, 0.5, 0.5]]]),
        np.concatenate([FACETS, [[0, 3, 8], [0, 8, 4]]]),
        "a closed surface; 2 edges belong to one triangle only, one at (",
    ),
    "not finite": (NOWHERE, FACETS, "vertices that are finite numbers below 1e+30; triangle 1 of"),
    "empty": (CORNERS, FACETS[:0], "an STL file with triangles; here are none"),
}


@pytest.mark.parametrize("case", FAULTS, ids=[c.replace(" ", "_") for c in FAULTS])
def test_surface_that_bounds_no_solid_is_refused(case: str, tmp_path: Path) -> None:
    vertices, triangles, sentence = FAULTS[case]
    with pytest.raises(MeshFileError) as caught:
        read_surface(write_stl(tmp_path / "fault.stl", vertices, triangles))
    assert str(caught.value).startswith(sentence)
    assert "\n" not in str(caught.value)


@pytest.mark.parametrize(
    "content", [b"", b"solid nothing\nendsolid\n", b"a word\n", b"\x00" * 83, b"\xff" * 500,
                BRACKET.read_bytes()[:-7]],
)  # fmt: skip
def test_file_that_is_no_stl_is_refused(content: bytes, tmp_path: Path) -> None:
    path = tmp_path / "fault.stl"
    path.write_bytes(content)
    with pytest.raises(MeshFileError, match="an STL file"):
        read_surface(path)


def test_more_shells_than_can_be_told_apart_are_refused(tmp_path: Path) -> None:
    at = np.arange(1001)[:, None, None] * np.array([2.0, 0.0, 0.0])
    facets = FACETS + 8 * np.arange(1001)[:, None, None]
    path = write_stl(tmp_path / "many.stl", (CORNERS + at).reshape(-1, 3), facets.reshape(-1, 3))
    with pytest.raises(MeshFileError, match="at most 1000 shells in one file; here are 1001"):
        read_surface(path)


def test_more_triangles_than_the_limit_are_told(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    path = tmp_path / "cube.stl"
    shutil.copyfile(CORPUS / "surface" / "cube.stl", path)
    monkeypatch.setattr(mesh_file, "TRIANGLES", replace(TRIANGLES, most=11))
    with pytest.raises(MeshFileError, match="with at most 11 triangles, not 12: a coarser"):
        read_surface(path)
    monkeypatch.setattr(mesh_file, "TRIANGLES", replace(TRIANGLES, most=12))
    assert len(read_surface(path)[1]) == 12
