"""Meshes and round solids: distances and parts against solid angles, samples and exact bodies."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from sandmould.analysis.free_space import (
    free_measure_between,
    free_part,
    mesh_below_m3,
    sphere_mesh_m3,
)
from sandmould.analysis.intersections import sphere_lens_m3, sphere_prism_m3
from sandmould.analysis.sections import solid_sections
from sandmould.analysis.tube_fill import tube_fill
from sandmould.geometry.geometry import Block, Scene
from sandmould.geometry.mesh import TriangleMesh
from sandmould.geometry.outline import signed_area_m2
from sandmould.geometry.revolved import Revolved
from sandmould.scenario.box import Box, Tube, build_scene
from sandmould.scenario.solids import Cylinder, cylinder_solid
from tests.unit.meshes import CORNERS, CUBE, FACETS, SHIPPED

RNG = np.random.default_rng(5)


def solid_angle(point: np.ndarray, mesh: TriangleMesh) -> np.ndarray:
    """Solid angle of the surface over 4 pi: 1 inside, 0 outside."""
    a, b, c = (mesh.corners_m - point[:, None, None]).transpose(2, 0, 1, 3)
    la, lb, lc = (np.linalg.norm(v, axis=2) for v in (a, b, c))
    triple = np.sum(a * np.cross(b, c), axis=2)
    rest = la * lb * lc + np.sum(a * b, 2) * lc + np.sum(b * c, 2) * la + np.sum(c * a, 2) * lb
    return 2 * np.arctan2(triple, rest).sum(axis=1) / (4 * np.pi)


def sampled_distance(point: np.ndarray, mesh: TriangleMesh, number: int = 60) -> np.ndarray:
    """Distance from the nearest of many places on the triangles: at most a step too large."""
    u, v = np.meshgrid(*[np.linspace(0, 1, number)] * 2)
    u, v = u[u + v <= 1 + 1e-12], v[u + v <= 1 + 1e-12]
    a, b, c = mesh.corners_m.transpose(1, 0, 2)[:, :, None]
    places = (a + u[:, None] * (b - a) + v[:, None] * (c - a)).reshape(-1, 3)
    return np.array([np.linalg.norm(places - p, axis=1).min() for p in point])


def spindle(radii: list[float], sides: int = 7) -> TriangleMesh:
    """A body of unequal rings about x: it bulges and narrows but never meets itself."""
    profile = [[0.0, 0.0], [float(len(radii) + 1), 0.0]]
    profile += [[float(k), radii[k - 1]] for k in range(len(radii), 0, -1)]
    return Revolved("spindle", np.zeros(3), np.eye(3)[0], np.array(profile)).mesh(sides)


@given(st.lists(st.floats(0.1, 2.0), min_size=1, max_size=4), st.integers(3, 8))
@settings(max_examples=20, deadline=None)
def test_distance_against_solid_angle_and_samples(radii: list[float], sides: int) -> None:
    mesh, rng = spindle(radii, sides), np.random.default_rng(4)
    point = rng.uniform([-1, -2.5, -2.5], [len(radii) + 2, 2.5, 2.5], (60, 3))
    found = mesh.distance_m(point)
    np.testing.assert_array_equal(found < 0, solid_angle(point, mesh) > 0.5)
    sampled = sampled_distance(point, mesh)
    assert (np.abs(found) <= sampled + 1e-12).all()
    np.testing.assert_allclose(np.abs(found), sampled, atol=0.06)


def test_sign_holds_next_to_edges_and_vertices() -> None:
    toward = RNG.normal(size=(400, 3))
    toward /= np.linalg.norm(toward, axis=1)[:, None]
    edges = SHIPPED.corners_m[:, :2].mean(axis=1)
    places = np.concatenate([SHIPPED.vertices_m, edges])[RNG.integers(0, 900, 400)]
    point = places + 0.01 * toward
    np.testing.assert_array_equal(SHIPPED.distance_m(point) < 0, solid_angle(point, SHIPPED) > 0.5)


def test_cube_as_mesh_is_the_block() -> None:
    mesh = TriangleMesh("cube", CORNERS, FACETS)
    assert mesh.measure == pytest.approx(1.0)
    point = RNG.uniform(-1, 2, (2000, 3))
    np.testing.assert_allclose(mesh.distance_m(point), CUBE.distance_m(point), atol=1e-14)


def test_beyond_the_reach_a_lower_bound_is_enough() -> None:
    mesh = spindle([1.0, 0.3, 1.5])
    point = RNG.uniform(-4, 7, (2000, 3))
    exact, near = mesh.distance_m(point), mesh.distance_m(point, 0.2)
    far = near != exact
    assert far.any()
    assert (near[far] > 0.2).all()
    assert (near[far] <= exact[far]).all()
    scene = Scene(3, (), (), (), meshes=(mesh,))
    np.testing.assert_array_equal(scene.clearance_m(point, 0.2), near)


def test_triangles_that_spheres_meet() -> None:
    point, radius = RNG.uniform(-60, 60, (50, 3)), RNG.uniform(1, 30, 50)
    found = set(zip(*(i.tolist() for i in SHIPPED.near_triangles(point, radius)), strict=True))
    for t, corners in enumerate(SHIPPED.corners_m):
        alone = TriangleMesh("one", corners, np.array([[0, 1, 2]]))
        near = np.flatnonzero(np.abs(alone.distance_m(point)) < radius).tolist()
        assert {(n, t) for n in near} == {p for p in found if p[1] == t}


def test_sphere_and_mesh_against_the_prism() -> None:
    section = np.array([[0.0, 0], [1, 0], [1, 1], [0, 1]])
    mesh = TriangleMesh("cube", CORNERS, FACETS)
    centre, radius = RNG.uniform(-0.5, 1.5, (300, 3)), RNG.uniform(0.05, 0.9, 300)
    # centres on a face, an edge and a corner, where the solid angle jumps
    centre[:3], radius[:3] = [[0.5, 0.5, 0.0], [0.5, 0.0, 0.0], [0.0, 0.0, 0.0]], 0.3
    found = sphere_mesh_m3(centre, radius, mesh)
    np.testing.assert_allclose(
        found, sphere_prism_m3(centre, radius, section, 0.0, 1.0), atol=1e-6, rtol=1e-6
    )
    ball = 4 / 3 * np.pi * 0.3**3
    np.testing.assert_allclose(found[:3], [ball / 2, ball / 4, ball / 8], rtol=1e-6)


def test_sphere_and_bracket_against_samples() -> None:
    centre = np.array([[30.0, 0, 0], [28, 9, 5], [0, 0, 9], [45, 5, 2], [0, 0, 0], [90, 0, 0]])
    radius = np.array([10.0, 6, 5, 8, 4, 10])
    cloud = RNG.uniform(-1, 1, (40_000, 3))
    cloud = cloud[np.linalg.norm(cloud, axis=1) < 1]
    share = sphere_mesh_m3(centre, radius, SHIPPED) / (4 / 3 * np.pi * radius**3)
    for c, r, s in zip(centre, radius, share, strict=True):
        assert (SHIPPED.distance_m(c + r * cloud) < 0).mean() == pytest.approx(s, abs=0.012)


def test_volume_below_heights() -> None:
    tilted = spindle([1.0, 0.3, 1.5])
    cloud = RNG.uniform(tilted.vertices_m.min(0), tilted.vertices_m.max(0), (40_000, 3))
    inside = tilted.distance_m(cloud) < 0
    around = np.prod(np.ptp(tilted.vertices_m, axis=0))
    heights = np.array([-2.0, -1.0, -0.2, 0.0, 0.7, 3.0])
    sampled = [around * (inside & (cloud[:, 2] < h)).mean() for h in heights]
    np.testing.assert_allclose(mesh_below_m3(tilted, heights), sampled, atol=0.02 * around)
    cube = TriangleMesh("cube", CORNERS, FACETS)
    steps = np.array([-1.0, 0.0, 0.25, 1.0, 2.0])
    np.testing.assert_allclose(mesh_below_m3(cube, steps), [0, 0, 0.25, 1, 1], atol=1e-15)


def test_free_space_of_a_meshed_plate_is_that_of_the_plate() -> None:
    box = build_scene(Box(width_m=0.1, depth_m=0.1, height_m=0.1), (), 3)
    plate = Block("plate", np.array([0.05, 0.05, 0.04]), np.array([0.03, 0.02, 0.004]), np.eye(3))
    mesh = TriangleMesh("plate", plate.corners(), plate.facets())
    as_block = Scene(3, box.walls, (plate,), ())
    as_mesh = Scene(3, box.walls, (), (), meshes=(mesh,))
    centre, radius = RNG.uniform(0, 0.1, (200, 3)), RNG.uniform(0.002, 0.03, 200)
    np.testing.assert_allclose(
        free_part(centre, radius, as_mesh), free_part(centre, radius, as_block), atol=1e-10
    )
    edges = np.linspace(0.0, 0.1, 8)
    np.testing.assert_allclose(
        free_measure_between(as_mesh, edges), free_measure_between(as_block, edges), atol=1e-15
    )


ROD = Cylinder(
    kind="cylinder", centre_m=(0.05, 0.04, 0.03), axis="x", diameter_m=0.02, length_m=0.06
)


def test_cylinder() -> None:
    rod = cylinder_solid(ROD)
    assert rod.measure == pytest.approx(np.pi * 0.01**2 * 0.06)
    point = np.array(
        [[0.05, 0.04, 0.03], [0.05, 0.04, 0.055], [0.084, 0.04, 0.043], [0.079, 0.04, 0.03]]
    )
    np.testing.assert_allclose(rod.distance_m(point), [-0.01, 0.015, 0.005, -0.001], atol=1e-15)
    low, high = rod.corners().min(axis=0), rod.corners().max(axis=0)
    np.testing.assert_allclose([*low, *high], [0.02, 0.03, 0.02, 0.08, 0.05, 0.04])


def test_round_solid_as_mesh_keeps_its_volume_and_its_distances() -> None:
    profile = np.array([[-1.0, 0], [0, 0], [0, 2], [4, 2], [4, 3], [-1, 3]])
    tube = Revolved("tube", np.array([0.1, 0, 0]), np.array([0.6, 0.0, 0.8]), profile)
    assert tube.measure == pytest.approx(np.pi * (9 * 5 - 4 * 4))
    mesh = tube.mesh()
    assert mesh.measure == pytest.approx(tube.measure, rel=1e-12)
    point = RNG.uniform(-6, 6, (3000, 3))
    np.testing.assert_allclose(mesh.distance_m(point), tube.distance_m(point), atol=2.5e-4 * 3)


def test_spheres_at_a_round_solid_within_the_stated_error() -> None:
    angle = np.linspace(0, np.pi, 257)
    profile = np.column_stack([np.cos(angle), np.sin(angle)])
    profile[[0, -1], 1] = 0.0
    ball = Revolved("ball", np.zeros(3), np.eye(3)[2], profile)
    radius = np.full(30, 0.1)
    distance = np.linspace(0.85, 1.15, 30)
    toward = RNG.normal(size=(30, 3))
    toward /= np.linalg.norm(toward, axis=1)[:, None]
    found = sphere_mesh_m3(toward * distance[:, None], radius, ball.mesh())
    exact = sphere_lens_m3(distance, radius, np.ones(30))
    np.testing.assert_allclose(found, exact, atol=3e-4 / 0.1 * 4 / 3 * np.pi * 1e-3)


def test_round_tube_has_its_bore_and_its_wall() -> None:
    tube = Tube(kind="tube", diameter_m=0.02, length_m=0.05, left_end_x_m=0.03, axis_height_m=0.04,
                section="round")  # fmt: skip
    box = Box(width_m=0.1, depth_m=0.06, height_m=0.1)
    scene = build_scene(box, (tube,), 3)
    assert not scene.blocks
    (bore,), (wall,) = scene.bores, scene.revolved
    assert bore.measure == pytest.approx(np.pi * 0.01**2 * 0.05, rel=1e-12)
    assert wall.measure == pytest.approx(np.pi * ((0.013**2 - 0.01**2) * 0.05 + 0.013**2 * 0.003))
    point = np.array(
        [[0.05, 0.03, 0.04], [0.0815, 0.03, 0.04], [0.029, 0.03, 0.0515], [0.079, 0.03, 0.04]]
    )
    np.testing.assert_allclose(wall.distance_m(point), [0.01, -0.0015, 0.001, 0.001], atol=1e-15)
    # a grain that touches the wall from within counts whole
    one = tube_fill(np.array([[0.05, 0.03, 0.047]]), np.array([0.003]), bore)
    assert one.sand_measure == pytest.approx(4 / 3 * np.pi * 0.003**3, rel=1e-4)
    other = tube.model_copy(update={"closed_end": "left"})
    (mirrored,) = build_scene(box, (other,), 3).revolved
    np.testing.assert_allclose(
        mirrored.distance_m(point * [-1, 1, 1] + [0.11, 0, 0]), wall.distance_m(point), atol=1e-15
    )
    at_wall = build_scene(box.model_copy(update={"width_m": 0.08}), (tube,), 3).revolved[0]
    assert at_wall.measure == pytest.approx(np.pi * (0.013**2 - 0.01**2) * 0.05)


def test_section_through_the_bracket_and_through_a_ring() -> None:
    (rim,) = solid_sections(SHIPPED, 0.0)
    assert abs(signed_area_m2(rim)) == pytest.approx(60 * 16 + 20 * 6, rel=2e-3)
    assert solid_sections(SHIPPED, 31.0) == []
    ring = Revolved("ring", np.zeros(3), np.eye(3)[1],
                    np.array([[0.0, 1], [1, 1], [1, 2], [0, 2]]))  # fmt: skip
    (slit,) = solid_sections(ring, 0.5)
    assert abs(signed_area_m2(slit)) == pytest.approx(3 * np.pi)
    assert len(solid_sections(ring.mesh(), 0.5)) == 1
    beside = Revolved("ring", np.zeros(3), np.eye(3)[0], ring.profile_m)
    assert len(solid_sections(beside, 0.3)) == 2
