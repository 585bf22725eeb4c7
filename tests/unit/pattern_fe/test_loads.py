"""Contact forces on the pattern's surface, pressures, distances and files."""

from __future__ import annotations

from pathlib import Path

import meshio
import numpy as np
import pytest
from numpy.typing import NDArray

from sandmould.geometry.mesh import signed_volumes_m3
from sandmould.geometry.mesh_file import read_surface
from sandmould.pattern_fe.export import write_stl, write_surface
from sandmould.pattern_fe.loads import pressure_above_and_below_pa, vertex_pressure_pa
from sandmould.pattern_fe.pattern import Pattern
from sandmould.pattern_fe.perimeter import Distance, Perimeter, distance_from_drawing
from sandmould.pattern_fe.shapes import bar, mesh_of
from tests.patterns import (
    FOOT,
    KINDS,
    _one_thread,  # noqa: F401
    frame,
    l_pattern,
    pattern_of_kind,
)

Array = NDArray[np.float64]


def _moment(place_m: Array, force_n: Array) -> Array:
    if place_m.shape[1] == 3:
        return np.cross(place_m, force_n).sum(axis=0)
    return np.sum(place_m[:, 0] * force_n[:, 1] - place_m[:, 1] * force_n[:, 0])[None]


def vertex_loads_n(
    perimeter: Perimeter, facet: NDArray[np.int64], point_m: Array, force_n: Array
) -> Array:
    """Forces at points on facets, shared among their vertices by linear shape functions, (56)."""
    corner = perimeter.vertices_m[perimeter.facets[facet]]
    edges = corner[:, 1:] - corner[:, :1]
    from_first = (point_m - corner[:, 0])[..., None]
    share = np.linalg.solve(edges @ edges.transpose(0, 2, 1), edges @ from_first)[..., 0]
    share = np.concatenate([1.0 - share.sum(axis=1, keepdims=True), share], axis=1)
    loads = np.zeros_like(perimeter.vertices_m)
    np.add.at(loads, perimeter.facets[facet], share[..., None] * force_n[:, None])
    return loads


@pytest.mark.parametrize("kind", KINDS)
@pytest.mark.parametrize("order", [1, 2])
def test_loads_keep_force_and_moment_also_on_a_deformed_pattern(kind: str, order: int) -> None:
    pattern = pattern_of_kind(kind, order)
    random = np.random.default_rng(5)
    displacement = 1e-3 * random.standard_normal(pattern.space.node_m.shape)
    surface = pattern.surface.moved(pattern.on_surface(displacement))
    d = surface.vertices_m.shape[1]
    facet = random.integers(len(surface.facets), size=200)
    share = random.dirichlet(np.ones(d), size=200)
    point = np.einsum("mk,mkd->md", share, surface.vertices_m[surface.facets[facet]])
    force = random.standard_normal((200, d))
    load = pattern.on_nodes(vertex_loads_n(surface, facet, point, force))
    place = pattern.space.node_m + displacement
    # 200 forces of 1 N at arms of 0.02 m: 1e-10 of their sum leaves four digits for round-off
    assert np.allclose(load.sum(axis=0), force.sum(axis=0), rtol=0.0, atol=1e-10 * 200)
    assert np.allclose(_moment(place, load), _moment(point, force), rtol=0.0, atol=1e-10 * 4)


def test_nodal_pressure_is_force_over_area_as_in_the_paper() -> None:
    surface = pattern_of_kind("quadrilaterals", 1).surface
    low = np.isclose(surface.vertices_m[:, 1], 0.0)
    facet = np.flatnonzero(low[surface.facets].all(axis=1))[:1]
    ends = surface.vertices_m[surface.facets[facet[0]]]
    point = 0.75 * ends[:1] + 0.25 * ends[1:]
    load = vertex_loads_n(surface, facet, point, np.array([[0.0, 8.0]]))
    # segments of 10 mm, thickness 0.25 m: every vertex has 2.5e-3 m2
    assert np.allclose(surface.vertex_area_m2, 2.5e-3)
    first, second = surface.facets[facet[0]]
    assert load[first, 1] == pytest.approx(0.75 * 8.0)
    middle = second if np.isclose(surface.vertices_m[second, 0], 0.01) else first
    share = 0.25 if middle == second else 0.75
    assert vertex_pressure_pa(surface, load)[middle] == pytest.approx(share * 8.0 / 2.5e-3)


@pytest.mark.parametrize("kind", KINDS)
def test_uniform_pressure_is_found_at_flat_parts_edges_and_corners(kind: str) -> None:
    surface = pattern_of_kind(kind, 2).surface
    load = -1500.0 * surface.vertex_area_vector_m2
    assert vertex_pressure_pa(surface, load) == pytest.approx(1500.0)


def distance(pattern: Pattern, displacement_m: Array) -> Distance:
    moved = pattern.surface.moved(pattern.on_surface(displacement_m))
    return distance_from_drawing(pattern.surface, moved)


def test_distance_counts_what_leaves_the_drawing_not_what_slides_along_it() -> None:
    pattern = Pattern(mesh_of(bar(0.02, 0.01), 0.01), FOOT, thickness_m=0.1)
    found = distance(pattern, np.tile([1e-3, 0.0], (len(pattern.space.node_m), 1)))
    # of 12 vertices 5 mm apart, three on the right leave and one on the left goes inside
    assert found.largest_m == pytest.approx(1e-3)
    assert found.rms_m == pytest.approx(1e-3 * np.sqrt(4.0 / 12.0))
    assert sorted(np.round(found.vertex_m, 9)) == [-1e-3, *[0.0] * 8, *[1e-3] * 3]


def test_distance_from_a_drawing_with_a_hole_is_positive_in_the_hole() -> None:
    pattern = Pattern(mesh_of(frame(0.01, 0.06, 0.08), 0.01), FOOT, thickness_m=0.02)
    found = distance(pattern, np.tile([1e-3, 0.0], (len(pattern.space.node_m), 1)))
    x, y = pattern.surface.vertices_m.T
    into = np.isclose(x, 0.01) & (y > 0.01 + 1e-9) & (y < 0.07 - 1e-9)  # left side of the hole
    assert found.vertex_m[into] == pytest.approx(1e-3)
    assert found.largest_m == pytest.approx(1e-3)


def test_distance_in_3d_is_that_to_the_nearest_triangle() -> None:
    pattern = pattern_of_kind("hexahedra", 1)
    found = distance(pattern, 0.05 * (pattern.space.node_m - 0.01))
    # a cube 5 % larger: corners sqrt(3)/2 mm away, faces 0.5 mm
    assert found.largest_m == pytest.approx(np.sqrt(3.0) * 0.5e-3)
    assert 0.5e-3 < found.rms_m < np.sqrt(3.0) * 0.5e-3


@pytest.mark.parametrize("order", [1, 2])
@pytest.mark.parametrize("kind", KINDS)
def test_stl_of_the_deformed_pattern_is_closed_and_has_its_volume(
    tmp_path: Path, kind: str, order: int
) -> None:
    pattern = pattern_of_kind(kind, order)
    stretched = 0.1 * pattern.space.node_m
    path = tmp_path / "deformed.stl"
    write_stl(path, pattern.space, pattern.surface, stretched)
    vertices, triangles = read_surface(path)
    d = pattern.space.dimension
    volume = 1.1**d * pattern.space.weight.sum()
    # STL holds seven digits
    assert signed_volumes_m3(vertices, triangles).sum() == pytest.approx(volume, rel=1e-5)


def test_stl_of_a_plate_keeps_its_hole(tmp_path: Path) -> None:
    pattern = Pattern(mesh_of(frame(0.01, 0.06, 0.08), 0.01), FOOT, thickness_m=0.02)
    path = tmp_path / "frame.stl"
    write_stl(path, pattern.space, pattern.surface, np.zeros_like(pattern.space.node_m))
    vertices, triangles = read_surface(path)
    volume = (0.06 * 0.08 - 0.04 * 0.06) * 0.02
    assert signed_volumes_m3(vertices, triangles).sum() == pytest.approx(volume, rel=1e-5)


@pytest.mark.parametrize("kind", KINDS)
def test_fields_for_paraview_come_back(tmp_path: Path, kind: str) -> None:
    pattern = pattern_of_kind(kind, 2)
    load = -1500.0 * pattern.surface.vertex_area_vector_m2
    displacement = pattern.solve_linear(pattern.on_nodes(load))
    d = pattern.space.dimension
    on_surface = pattern.on_surface(displacement)
    write_surface(tmp_path / "surface.vtu", pattern.surface, on_surface, load)
    surface = meshio.read(tmp_path / "surface.vtu")
    assert surface.point_data["pressure_pa"] == pytest.approx(1500.0)
    assert np.allclose(surface.points[:, :d], pattern.surface.vertices_m + on_surface)
    away_m = surface.point_data["distance_m"]
    assert np.abs(away_m).max() == pytest.approx(distance(pattern, displacement).largest_m)
    write_surface(tmp_path / "bare.vtu", pattern.surface, on_surface)
    bare = meshio.read(tmp_path / "bare.vtu")
    assert set(bare.point_data) == {"displacement_m", "distance_m"}
    assert np.array_equal(surface.point_data["displacement_m"][:, :d], on_surface)


@pytest.mark.parametrize("kind", ["an L", "hexahedra", "tetrahedra"])
def test_inner_nodes_follow_the_outer_surface_as_under_loads_on_it(kind: str) -> None:
    pattern = l_pattern() if kind == "an L" else pattern_of_kind(kind, 2)
    line = pattern.surface.outer_line
    load = np.zeros_like(pattern.surface.vertices_m)
    load[line] = -1500.0 * pattern.surface.vertex_area_vector_m2[line]
    answer = pattern.solve_linear(pattern.on_nodes(load))
    spread = pattern.spread(pattern.on_surface(answer)[line])
    assert spread == pytest.approx(answer, abs=1e-12)


def test_loads_of_a_wrong_shape_or_value_are_refused() -> None:
    pattern = l_pattern()
    load = np.zeros_like(pattern.space.node_m)
    with pytest.raises(ValueError, match=r"have the shape \(3, 2\), valid is \(\d+, 2\)"):
        pattern.solve_linear(load[:3])
    load[0, 0] = np.nan
    with pytest.raises(ValueError, match="component that is not finite"):
        pattern.solve_large(load)


def test_even_pressures_above_and_below_a_flange_are_found_again() -> None:
    pattern = l_pattern()
    outer = pattern.surface.outer
    area = outer.vertex_area_vector_m2
    free = ~outer.held(pattern.fixed).any(axis=1)
    up = area[:, 1] > 0.0
    # 1 000 Pa on all that faces up, 200 Pa on all that faces down, and sand beside it.
    load_n = -np.where(up, 1000.0, 200.0)[:, None] * area
    above_pa, below_pa = pressure_above_and_below_pa(outer, load_n, free)
    assert above_pa == pytest.approx(1000.0)
    assert below_pa == pytest.approx(200.0)
    nothing = pressure_above_and_below_pa(outer, load_n, np.zeros_like(free))
    assert np.isnan(nothing).all()


@pytest.mark.parametrize("kind", ["an L", "hexahedra", "tetrahedra"])
def test_pressures_of_many_contacts_are_those_of_a_count_by_faces(kind: str) -> None:
    """Contacts of unlike force, twice as many at one end: each face's sum over its own area."""
    pattern = l_pattern() if kind == "an L" else pattern_of_kind(kind, 2)
    outer = pattern.surface.outer
    free = ~outer.held(pattern.fixed).any(axis=1)
    random = np.random.default_rng(7)
    area_m2 = outer.facet_area_vector_m2
    size_m2 = np.linalg.norm(area_m2, axis=1)
    normal = area_m2 / size_m2[:, None]
    facet = random.choice(len(size_m2), 20_000, p=size_m2 / size_m2.sum())
    share = random.dirichlet(np.ones(outer.facets.shape[1]), len(facet))
    corners_m = outer.vertices_m[outer.facets[facet]]
    point_m = np.einsum("ni,nij->nj", share, corners_m)
    along = (point_m[:, 0] - point_m[:, 0].min()) / np.ptp(point_m[:, 0])
    press_n = (1.0 + along) * random.exponential(1e3 * size_m2.sum() / len(facet), len(facet))
    force_n = -press_n[:, None] * normal[facet]
    told = pressure_above_and_below_pa(outer, vertex_loads_n(outer, facet, point_m, force_n), free)
    counted = free[outer.facets].all(axis=1)
    for pressure_pa, faces in zip(
        told, (counted & (normal[:, -1] > 0.5), counted & (normal[:, -1] < -0.5)), strict=True
    ):
        if faces.any():
            by_count_pa = -force_n[faces[facet], -1].sum() / area_m2[faces, -1].sum()
            assert pressure_pa == pytest.approx(by_count_pa, rel=0.02)
