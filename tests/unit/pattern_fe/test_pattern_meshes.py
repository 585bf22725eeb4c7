"""Meshes of patterns: shapes, files, and what is refused."""

from __future__ import annotations

import re
from pathlib import Path
from typing import Any

import meshio
import numpy as np
import pytest
from skfem import MeshQuad, MeshTri

from sandmould.pattern_fe.checks import check_inside, check_mesh
from sandmould.pattern_fe.material import Foam
from sandmould.pattern_fe.mesh_file import read_mesh
from sandmould.pattern_fe.pattern import Pattern
from sandmould.pattern_fe.shapes import bar, l_shape, mesh_of, with_sides
from sandmould.pattern_fe.supports import Supports
from tests.patterns import (
    FOOT,
    KINDS,
    _one_thread,  # noqa: F401
    frame,
    mesh_of_kind,
    pattern_of_kind,
    write_mesh,
)


@pytest.mark.parametrize(
    ("rectangles", "area_mm2"),
    [
        (bar(0.02, 0.01), 200.0),
        (l_shape(0.015, 0.06, 0.075), 15 * 60 + 60 * 15),
        (frame(0.01, 0.06, 0.08), 60 * 80 - 40 * 60),
    ],
)
@pytest.mark.parametrize("depth_m", [None, 0.02])
def test_shape_has_its_measure_and_named_sides(
    rectangles: Any, area_mm2: float, depth_m: float | None
) -> None:
    mesh = mesh_of(rectangles, 0.005, depth_m)
    pattern = Pattern(mesh, FOOT, order=1, thickness_m=0.3 if depth_m is None else None)
    assert pattern.space.weight.sum() == pytest.approx(1e-6 * area_mm2 * (depth_m or 0.3))
    foot_m = mesh.p[:, mesh.facets[:, mesh.boundaries["bottom"]]]
    assert np.allclose(foot_m[-1], 0.0)
    sides = {"left", "right", "bottom", "top"} | ({"front", "back"} if depth_m else set())
    assert set(mesh.boundaries) == sides


def test_elements_through_the_thickness_are_as_many_as_asked() -> None:
    mesh = mesh_of(l_shape(0.015, 0.06, 0.075), 0.015 / 4)
    tip = np.isclose(mesh.p[0], 0.075)
    assert tip.sum() == 5


@pytest.mark.parametrize("kind", KINDS)
@pytest.mark.parametrize("order", [1, 2])
def test_perimeter_is_closed_and_faces_outwards(kind: str, order: int) -> None:
    surface = pattern_of_kind(kind, order).surface
    area = surface.facet_area_vector_m2
    d = surface.vertices_m.shape[1]
    assert np.allclose(area.sum(axis=0), 0.0, atol=1e-12)
    middle = surface.vertices_m[surface.facets].mean(axis=1)
    volume = np.sum(middle * area) / d
    assert volume == pytest.approx(0.02**2 * 0.25 if d == 2 else 0.02**3)
    assert surface.vertex_area_m2.sum() == pytest.approx(0.08 * 0.25 if d == 2 else 6 * 0.02**2)
    on_faces = np.isclose(surface.vertices_m, 0.0) | np.isclose(surface.vertices_m, 0.02)
    assert on_faces.any(axis=1).all()


def test_outline_of_second_order_has_the_nodes_inside_edges_too_in_order() -> None:
    first, second = (pattern_of_kind("quadrilaterals", order).surface for order in (1, 2))
    assert (len(first.facets), len(second.facets)) == (8, 16)
    n = len(second.vertices_m)
    assert (second.facets == np.stack([np.arange(n), (np.arange(n) + 1) % n], axis=1)).all()
    assert np.ptp(np.linalg.norm(second.facet_area_vector_m2, axis=1)) < 1e-15


def test_frame_has_two_closed_lines_around_its_material() -> None:
    surface = Pattern(mesh_of(frame(0.01, 0.06, 0.08), 0.01), FOOT, thickness_m=1.0).surface
    areas = []
    for loop in surface.loops:
        x, y = surface.vertices_m[loop].T
        areas.append(0.5 * np.sum(x * np.roll(y, -1) - np.roll(x, -1) * y))
    assert areas == pytest.approx([60e-3 * 80e-3, -40e-3 * 60e-3])


@pytest.mark.parametrize("kind", KINDS)
@pytest.mark.parametrize("suffix", [".vtu", ".vtk"])
def test_file_brings_back_mesh_and_names(tmp_path: Path, kind: str, suffix: str) -> None:
    mesh = mesh_of_kind(kind)
    inner = np.flatnonzero(mesh.p[0, mesh.facets].max(axis=0) < 0.015)
    mesh = mesh.with_boundaries({"gate": np.intersect1d(inner, mesh.boundaries["bottom"])})
    write_mesh(tmp_path / f"pattern{suffix}", mesh)
    found = read_mesh(tmp_path / f"pattern{suffix}")
    assert type(found) is type(mesh)
    assert np.allclose(found.p, mesh.p, rtol=0.0, atol=1e-15)
    assert set(found.boundaries) == set(mesh.boundaries)
    for name, facets in mesh.boundaries.items():
        own = {tuple(np.sort(f)) for f in mesh.facets[:, facets].T}
        assert {tuple(np.sort(f)) for f in found.facets[:, found.boundaries[name]].T} == own


_NAMES = """$PhysicalNames
3
1 1 "foot"
1 2 "end"
2 3 "foam"
$EndPhysicalNames
"""
_GMSH = {
    "2.2": """$MeshFormat
2.2 0 8
$EndMeshFormat
"""
    + _NAMES
    + """$Nodes
6
1 0 0 0
2 20 0 0
3 20 10 0
4 0 10 0
5 10 0 0
6 10 10 0
$EndNodes
$Elements
5
1 1 2 1 1 1 5
2 1 2 1 1 5 2
3 1 2 2 2 2 3
4 3 2 3 1 1 5 6 4
5 3 2 3 1 5 2 3 6
$EndElements
""",
    "4.1": """$MeshFormat
4.1 0 8
$EndMeshFormat
"""
    + _NAMES
    + """$Entities
0 2 1 0
1 0 0 0 20 0 0 1 1 0
2 20 0 0 20 10 0 1 2 0
1 0 0 0 20 10 0 1 3 0
$EndEntities
$Nodes
1 6 1 6
2 1 0 6
1
2
3
4
5
6
0 0 0
20 0 0
20 10 0
0 10 0
10 0 0
10 10 0
$EndNodes
$Elements
3 5 1 5
1 1 1 2
1 1 5
2 5 2
1 2 1 1
3 2 3
2 1 3 2
4 1 5 6 4
5 5 2 3 6
$EndElements
""",
}

# a side that is in no group, as Mesh.SaveAll writes it
_GMSH["4.1, all saved"] = (
    _GMSH["4.1"]
    .replace("0 2 1 0\n", "0 3 1 0\n")
    .replace("2 20 0 0 20 10 0 1 2 0\n", "2 20 0 0 20 10 0 1 2 0\n3 0 10 0 20 10 0 0 0\n")
    .replace("3 5 1 5\n", "4 6 1 6\n1 3 1 1\n6 3 6\n")
)


@pytest.mark.parametrize("version", _GMSH)
def test_physical_groups_become_boundaries_in_the_unit_asked(tmp_path: Path, version: str) -> None:
    path = tmp_path / "groups.msh"
    path.write_text(_GMSH[version])
    found = read_mesh(path, unit_m=1e-3)
    assert found.p.max() == pytest.approx(0.02)
    foot_m = found.p[:, found.facets[:, found.boundaries["foot"]]]
    assert foot_m.shape == (2, 2, 2)
    assert not foot_m[1].any()
    assert len(found.boundaries["end"]) == 1


def test_mid_side_nodes_of_a_file_are_dropped(tmp_path: Path) -> None:
    points = np.array([[0, 0], [1, 0], [0, 1], [0.5, 0.1], [0.6, 0.6], [0, 0.5]], dtype=float)
    path = tmp_path / "curved.vtu"
    meshio.write(path, meshio.Mesh(np.pad(points, ((0, 0), (0, 1))), [("triangle6", [range(6)])]))
    mesh = read_mesh(path)
    assert type(mesh) is MeshTri
    assert mesh.p.shape == (2, 3)


def _two_squares(gap_m: float) -> Any:
    one = MeshQuad.init_tensor(np.linspace(0, 1, 3), np.linspace(0, 1, 3))
    return one + one.translated((1.0 + gap_m, 1.0 if gap_m == 0.0 else 0.0))


@pytest.mark.parametrize("kind", KINDS)
def test_inverted_elements_are_counted_and_named(kind: str) -> None:
    mesh = mesh_of_kind(kind, 0.005)
    points = mesh.p.copy()
    pulled = mesh.interior_nodes()[0]
    points[0, pulled] += 0.006
    with pytest.raises(
        ValueError, match=r"has \d+ inverted or degenerate elements of \d+ \("
    ) as no:
        check_mesh(type(mesh)(points, mesh.t))
    counted, *named = map(int, re.findall(r"\d+", str(no.value).replace(str(mesh.nelements), "")))
    around = np.flatnonzero((mesh.t == pulled).any(axis=0))
    assert 0 < counted < len(around)
    assert set(named[:-1]) <= set(around)


@pytest.mark.parametrize("kind", KINDS)
def test_sound_meshes_are_let_through_whichever_way_their_corners_run(kind: str) -> None:
    mesh = mesh_of_kind(kind)
    check_mesh(mesh)
    check_mesh(type(mesh)(mesh.p * np.array([[-1.0]] + [[1.0]] * (mesh.dim() - 1)), mesh.t))


def test_flat_triangle_is_degenerate() -> None:
    points = np.array([[0, 1, 0, 1, 0.5], [0, 0, 1, 1, 1.0]])
    mesh = MeshTri(points, np.array([[0, 1, 2], [1, 2, 3], [2, 3, 4]]).T)
    with pytest.raises(ValueError, match=r"inverted or degenerate elements of 3 \(.*2"):
        check_mesh(mesh)


def test_several_pieces_are_refused() -> None:
    with pytest.raises(ValueError, match="2 pieces that share no face"):
        check_mesh(_two_squares(0.5))


def test_face_of_three_elements_leaves_the_outline_open() -> None:
    points = np.array([[0, 0, 1, -1, 1], [0, 1, 0.5, 0.5, 0.6]], dtype=float)
    mesh = MeshTri(points, np.array([[0, 1, 2], [0, 1, 3], [0, 1, 4]]).T)
    with pytest.raises(ValueError, match=r"has 1 faces .* so its outline is not closed"):
        check_mesh(mesh)


def test_outline_that_touches_itself_is_refused() -> None:
    # a ring of five squares whose ends meet in one corner
    mesh = mesh_of([(0, 0, 1, 3), (1, 0, 3, 1), (2, 1, 3, 2), (1, 2, 2, 3)], 1.0)
    with pytest.raises(ValueError, match=r"touches itself at 1 nodes, one at \(2, 2\) m"):
        Pattern(mesh, FOOT, order=1, thickness_m=1.0)


def test_pattern_outside_a_box_is_refused() -> None:
    mesh = mesh_of_kind("quadrilaterals")
    check_inside(mesh.p.T, np.zeros(2), np.full(2, 0.02))
    with pytest.raises(ValueError, match=r"reaches from \(0, 0\) to \(0.02, 0.02\) m, valid is in"):
        check_inside(mesh.p.T, np.zeros(2), np.array([0.02, 0.019]))


@pytest.mark.parametrize(
    ("foam", "said"),
    [
        ({"poisson": 0.5}, r"Poisson's ratio of the pattern is 0.5, valid is above -1 and below"),
        ({"poisson": -1.0}, "valid is above -1"),
        ({"young_pa": 0.0}, "Young's modulus of the pattern is 0 Pa, valid is above 0"),
        ({"density_kg_m3": -12.0}, "density of the pattern is -12 kg/m3"),
    ],
)
def test_impossible_foam_is_refused(foam: dict[str, float], said: str) -> None:
    with pytest.raises(ValueError, match=said):
        Foam(**foam)


@pytest.mark.parametrize(
    ("supports", "said"),
    [
        (Supports(), r"no support, so it is free to (shift|turn).*, .*, .*its motion can be"),
        (Supports(resting=("bottom",)), "free to shift along x;"),
        (Supports(resting=("bottom", "top")), "free to shift along x;"),
        (Supports(resting=("left",), clamped=()), "free to shift along y;"),
    ],
)
def test_statics_of_a_loose_pattern_is_refused(supports: Supports, said: str) -> None:
    pattern = pattern_of_kind("quadrilaterals", 1, supports)
    load = np.zeros_like(pattern.space.node_m)
    for solve in (pattern.solve_linear, pattern.solve_large):
        with pytest.raises(ValueError, match=said):
            solve(load)


def test_rollers_on_two_sides_or_a_bedding_hold_a_pattern() -> None:
    for supports in (Supports(resting=("left", "bottom")), Supports(bedding_n_m3=1e6)):
        pattern = pattern_of_kind("hexahedra", 1, Supports(resting=("left", "bottom", "front")))
        assert not pattern.solve_linear(np.zeros_like(pattern.space.node_m)).any()
        pattern_of_kind("triangles", 1, supports).solve_linear(np.zeros((9, 2)))


@pytest.mark.parametrize(
    ("supports", "said"),
    [
        (Supports(clamped=("foot",)), "'foot', which is not there: valid bottom, left, right, top"),
        (Supports(clamped=("bottom",), bedding_n_m3=-1.0), "bedding is -1 N/m3"),
    ],
)
def test_unknown_supports_are_refused(supports: Supports, said: str) -> None:
    with pytest.raises(ValueError, match=said):
        pattern_of_kind("quadrilaterals", 1, supports)


def test_roller_needs_a_flat_boundary() -> None:
    mesh = mesh_of_kind("quadrilaterals")
    bent = mesh.with_boundaries(
        {"bent": np.union1d(mesh.boundaries["left"], mesh.boundaries["top"])}
    )
    with pytest.raises(ValueError, match=r"resting boundary 'bent' extends 0.02 m"):
        Pattern(bent, Supports(resting=("bent",)), thickness_m=1.0)


@pytest.mark.parametrize(
    ("asked", "said"),
    [
        ({"thickness_m": None}, "thickness of the pattern is None m, valid in 2D is above 0"),
        ({"thickness_m": 1.0, "order": 3}, "order of the pattern's elements is 3, valid is 1 or 2"),
    ],
)
def test_missing_thickness_and_unknown_order_are_refused(asked: Any, said: str) -> None:
    with pytest.raises(ValueError, match=said):
        Pattern(mesh_of_kind("quadrilaterals"), FOOT, **asked)


def test_thickness_in_3d_is_refused() -> None:
    with pytest.raises(ValueError, match=r"is 0\.1 m, valid in 2D alone"):
        Pattern(mesh_of_kind("hexahedra"), FOOT, thickness_m=0.1)


@pytest.mark.parametrize(
    ("rectangles", "element_m", "said"),
    [
        (bar(0.02, 0.01), 0.0, "element size of the pattern is 0 m, valid is above 0"),
        (bar(0.02, -0.01), 0.01, "need a positive width, height and depth"),
        ([], 0.01, "need a positive width"),
    ],
)
def test_shape_without_extent_is_refused(rectangles: Any, element_m: float, said: str) -> None:
    with pytest.raises(ValueError, match=said):
        mesh_of(rectangles, element_m)


def _file(path: Path, cells: Any, points: Any) -> Path:
    meshio.write(path, meshio.Mesh(np.array(points, dtype=float), cells))
    return path


def test_files_that_hold_no_pattern_are_refused(tmp_path: Path) -> None:
    square = [[0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0], [2, 0, 0]]
    mixed = [("triangle", [[1, 4, 2]]), ("quad", [[0, 1, 2, 3]])]
    bent = [[0, 0, 0], [1, 0, 0], [0, 1, 0], [0, 0, 1]]
    files = {
        "quad, triangle, valid is one kind": _file(tmp_path / "m.vtu", mixed, square),
        "elements line, valid": _file(tmp_path / "l.vtu", [("line", [[0, 1]])], square),
        "a surface in space, not closed": _file(
            tmp_path / "s.stl", [("triangle", [[0, 1, 2], [0, 1, 3]])], bent
        ),
        "cannot be read .*, valid is a mesh": tmp_path / "missing.msh",
    }
    (tmp_path / "text.msh").write_text("no mesh")
    files[r"text.msh cannot be read \(Error: Couldn't read"] = tmp_path / "text.msh"
    for said, path in files.items():
        with pytest.raises(ValueError, match=said):
            read_mesh(path)
    with pytest.raises(ValueError, match=r"unit of the mesh file m.vtu is 0.0 m, valid is above 0"):
        read_mesh(tmp_path / "m.vtu", unit_m=0.0)


def test_name_of_a_group_wins_over_that_of_a_side() -> None:
    mesh = mesh_of_kind("quadrilaterals")
    named = MeshQuad(mesh.p, mesh.t).with_boundaries({"top": mesh.boundaries["left"]})
    assert (with_sides(named).boundaries["top"] == mesh.boundaries["left"]).all()
