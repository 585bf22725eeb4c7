"""STEP files and what Gmsh makes of drawings: surfaces, tetrahedra, and what is refused."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from sandmould.bad_input import BadInputError
from sandmould.geometry import mesher
from sandmould.geometry.drawing_file import MeshFileError
from sandmould.geometry.mesh import TriangleMesh
from sandmould.geometry.mesh_file import read_surface
from sandmould.geometry.mesher import step_tetrahedra, surface_tetrahedra
from sandmould.scenario.solids import SolidMesh, mesh_solid
from tests.bracket import BRACKET, STEP, write_solid
from tests.unit.meshes import CORNERS, FACETS, SHIPPED

Build = Callable[[Any], Any]
TEN = (10, 10, 10)
SOLIDS: dict[str, tuple[Build, float]] = {
    "hollow": (lambda k: k.cut([(3, k.addBox(0, 0, 0, *TEN))], [(3, k.addBox(3, 3, 3, 4, 4, 4))]),
               936.0),
    "two that meet": (lambda k: (k.addBox(0, 0, 0, *TEN), k.addBox(5, 5, 5, *TEN)), 1875.0),
}  # fmt: skip


def volume_m3(nodes_m: np.ndarray, tetrahedra: np.ndarray) -> float:
    edges = nodes_m[tetrahedra[:, 1:]] - nodes_m[tetrahedra[:, :1]]
    return float(np.abs(np.linalg.det(edges)).sum()) / 6.0


def test_a_step_file_is_the_stl_of_its_part_in_metres() -> None:
    mesh = TriangleMesh("bracket", *read_surface(STEP))
    low_mm, high_mm = 1e3 * mesh.vertices_m.min(axis=0), 1e3 * mesh.vertices_m.max(axis=0)
    # sides of a circle: within 0.1 % of the radius
    np.testing.assert_allclose(low_mm, [-30, -30, -8], atol=0.03)
    np.testing.assert_allclose(high_mm, [50, 30, 8], atol=0.03)
    assert mesh.measure == pytest.approx(1e-9 * SHIPPED.measure, rel=2e-3)
    np.testing.assert_array_equal(read_surface(STEP)[0], mesh.vertices_m)


@pytest.mark.parametrize("case", SOLIDS)
def test_solids_of_a_step_file_are_one_with_their_cavities(case: str, tmp_path: Path) -> None:
    build, volume_mm3 = SOLIDS[case]
    path = tmp_path / "part.stp"
    write_solid(path, build)
    surface = read_surface(path)
    assert TriangleMesh("part", *surface).measure == pytest.approx(1e-9 * volume_mm3, rel=1e-9)
    for nodes_m, tetrahedra in (step_tetrahedra(path, 4e-3), surface_tetrahedra(*surface, 4e-3)):
        # flat faces: nothing is lost
        assert volume_m3(nodes_m, tetrahedra) == pytest.approx(1e-9 * volume_mm3, rel=1e-9)


def test_a_finer_mesh_has_more_elements_and_is_the_same_from_call_to_call() -> None:
    vertices, triangles = read_surface(BRACKET)
    made = [surface_tetrahedra(1e-3 * vertices, triangles, size_m) for size_m in (16e-3, 8e-3)]
    assert len(made[1][1]) > 2 * len(made[0][1])
    again = surface_tetrahedra(1e-3 * vertices, triangles, 16e-3)
    np.testing.assert_array_equal(again[0], made[0][0])
    np.testing.assert_array_equal(again[1], made[0][1])


FACE: Build = lambda k: k.addRectangle(0, 0, 0, 10, 10)  # noqa: E731


@pytest.mark.parametrize(
    ("content", "says"),
    [(FACE, "can mesh; the file has no solid: faces"), ("a word", "can mesh; Could not read file")],
)
def test_a_step_file_without_a_solid_is_refused(
    content: Build | str, says: str, tmp_path: Path
) -> None:
    path = tmp_path / "part.step"
    if isinstance(content, str):
        path.write_text(content)
    else:
        write_solid(path, content)
    with pytest.raises(MeshFileError, match=says) as caught:
        read_surface(path)
    assert "\n" not in str(caught.value)


def test_a_unit_beside_the_one_of_a_step_file_is_refused() -> None:
    solid = SolidMesh(kind="mesh", file=str(STEP), unit_m=0.001)
    with pytest.raises(BadInputError, match=r"obstacles.0.unit_m = 0.001 .* tells its own unit"):
        mesh_solid(solid, "obstacles.0")


def test_where_gmsh_is_missing_that_is_told(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    (tmp_path / "gmsh.py").write_text(
        "raise OSError('libGLU.so.1: cannot open shared object file')"
    )
    monkeypatch.setenv("PYTHONPATH", str(tmp_path))
    with pytest.raises(MeshFileError, match=r"not installed here: pip install 'sandmould\[cad\]'"):
        surface_tetrahedra(CORNERS, FACETS, 0.5)


def test_a_mesh_that_takes_too_long_is_given_up(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(mesher, "LONGEST_S", 1e-3)
    with pytest.raises(MeshFileError, match=r"within 0.001 s: a larger element"):
        surface_tetrahedra(CORNERS, FACETS, 0.5)
