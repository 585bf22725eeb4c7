"""Cavities of every shape: a few grains by hand, equal shapes, turned ones, and their voids."""

from __future__ import annotations

import math

import numpy as np
import pytest
from numpy.testing import assert_allclose

from sandmould.analysis.cavity_fill import cavity_fill, cavity_voids
from sandmould.analysis.free_space import part_in_solid
from sandmould.analysis.intersections import disc_lens_m2
from sandmould.geometry.geometry import Block, Cavity, Scene, Wall
from sandmould.geometry.mesh import TriangleMesh
from sandmould.geometry.outline import Outline
from sandmould.scenario.solids import cylinder_along
from tests.unit.meshes import FACETS

GRAIN_M = 2.0
HALF_CELL_M = GRAIN_M / 32
"""Of the grid in 2D: how well the border of a void is known, so that areas are to it times its
length."""


def turned(angle: float) -> np.ndarray:
    c, s = math.cos(angle), math.sin(angle)
    return np.array([[c, s], [-s, c]])


def open_box(low, high, opens=(0.0, 1.0)) -> Cavity:
    low, high = np.array(low, dtype=float), np.array(high, dtype=float)
    block = Block("hole", (low + high) / 2, (high - low) / 2, np.eye(len(low)))
    return Cavity("hole", block, -np.array(opens))


def polygon(vertices, opens=(0.0, 1.0)) -> Cavity:
    return Cavity("hole", Outline("hole", np.array(vertices, dtype=float)), -np.array(opens))


def scene(dimension: int, *blocks: Block) -> Scene:
    """Walls far away, and some blocks."""
    floor = Wall("floor", np.full(dimension, -1e3), np.eye(dimension)[-1])
    return Scene(dimension, (floor,), blocks, ())


HOLE = open_box((0, 0), (4, 10))
GRAINS = np.array([[2.0, 1.0], [2.0, 10.0], [2.0, 12.0], [0.0, 5.0]])
"""At the bottom, cut in half by the mouth, outside, cut in half by the side half way down."""


def test_four_discs_in_a_hole_that_opens_upwards() -> None:
    radius = np.ones(4)
    got = cavity_fill(GRAINS, radius, HOLE, GRAIN_M, bed_fraction=0.5)
    assert got.sand_measure == pytest.approx(2 * math.pi)
    assert got.fill_fraction == pytest.approx(2 * math.pi / 40)
    assert got.grains_inside == 1
    # slabs of 2 x 4 hold pi/2, 0, pi/2, 0, pi: 0.20, 0, 0.20, 0, 0.39 of their space
    for bed_fraction, depth_m in ((0.5, 2.0), (0.38, 6.0), (0.79, 0.0)):
        found = cavity_fill(GRAINS, radius, HOLE, GRAIN_M, bed_fraction).filled_depth_m
        assert found == pytest.approx(depth_m)
    assert math.isnan(cavity_fill(GRAINS, radius, HOLE, GRAIN_M, math.nan).filled_depth_m)
    empty = cavity_fill(np.zeros((0, 2)), np.zeros(0), HOLE, GRAIN_M, 0.5)
    assert (empty.sand_measure, empty.grains_inside, empty.filled_depth_m) == (0.0, 0, 0.0)


def test_depth_counts_from_the_mouth_whichever_way_it_opens() -> None:
    # a grain at the bottom, three quarters of the rest: the same hole upside down has it on top
    points = np.array([[2.0, 1.0], [2.0, 9.5]])
    assert_allclose(HOLE.depth_m(points), [9.0, 0.5])
    assert_allclose(open_box((0, 0), (4, 10), (0, -1)).depth_m(points), [1.0, 9.5])
    assert_allclose(open_box((0, 0), (4, 10), (1, 0)).depth_m(points), [2.0, 2.0])
    assert open_box((0, 0), (4, 10), (-1, 0)).length_m == pytest.approx(4.0)


@pytest.mark.parametrize("angle", [0.3, math.pi / 2, 2.9])
def test_a_turned_hole_with_turned_discs_measures_the_same(angle: float) -> None:
    rng = np.random.default_rng(5)
    position, radius = rng.uniform(-2, 12, (150, 2)), rng.uniform(0.1, 0.7, 150)
    axes = turned(angle)
    block = HOLE.space
    assert isinstance(block, Block)
    moved = Block("hole", block.centre_m @ axes + 3.0, block.half_size_m, axes)
    other = Cavity("hole", moved, HOLE.inward @ axes)
    straight = cavity_fill(position, radius, HOLE, GRAIN_M, 0.5)
    found = cavity_fill(position @ axes + 3.0, radius, other, GRAIN_M, 0.5)
    assert found.sand_measure == pytest.approx(straight.sand_measure, rel=1e-12)
    assert found.grains_inside == straight.grains_inside > 10
    assert found.filled_depth_m == pytest.approx(straight.filled_depth_m)
    assert 0.0 < straight.filled_depth_m < 10.0


def test_a_polygon_measures_as_the_equal_box_and_an_l_as_its_two_parts() -> None:
    rng = np.random.default_rng(6)
    position, radius = rng.uniform(-2, 12, (150, 2)), rng.uniform(0.1, 0.7, 150)
    box = cavity_fill(position, radius, HOLE, GRAIN_M, 0.5)
    same = polygon([(0, 0), (4, 0), (4, 10), (0, 10)])
    got = cavity_fill(position, radius, same, GRAIN_M, 0.5)
    assert got.sand_measure == pytest.approx(box.sand_measure, rel=1e-12)
    assert (got.grains_inside, got.filled_depth_m) == (box.grains_inside, box.filled_depth_m)
    both = polygon([(0, 0), (8, 0), (8, 3), (4, 3), (4, 10), (0, 10)])
    rest = cavity_fill(position, radius, open_box((4, 0), (8, 3)), GRAIN_M, 0.5)
    l_shaped = cavity_fill(position, radius, both, GRAIN_M, 0.5)
    assert l_shaped.sand_measure == pytest.approx(box.sand_measure + rest.sand_measure, rel=1e-12)
    assert l_shaped.fill_fraction == pytest.approx(l_shaped.sand_measure / 52)


def test_three_spheres_in_a_pit_and_a_mesh_of_it() -> None:
    pit = open_box((0, 0, 0), (4, 4, 10), (0, 0, 1))
    block = pit.space
    assert isinstance(block, Block)
    mesh = Cavity("hole", TriangleMesh("hole", block.corners(), FACETS), pit.inward)
    position = np.array([[2.0, 2.0, 1.0], [2.0, 2.0, 10.0], [2.0, 0.0, 5.0], [4.0, 4.0, 7.0]])
    # whole, half, half, and a quarter at an upright edge
    sand = (1 + 0.5 + 0.5 + 0.25) * 4 / 3 * math.pi
    for cavity in (pit, mesh):
        got = cavity_fill(position, np.ones(4), cavity, GRAIN_M, bed_fraction=0.2)
        assert got.sand_measure == pytest.approx(sand, rel=2e-6)
        assert got.fill_fraction == pytest.approx(sand / 160, rel=2e-6)
        # slabs of 32: 0.131 (bottom) is half as dense as the bed, 0.065 and 0.033 are not
        assert got.filled_depth_m == pytest.approx(2.0)
    rng = np.random.default_rng(7)
    position, radius = rng.uniform(-2, 12, (300, 3)), rng.uniform(0.2, 1.5, 300)
    box, found = (cavity_fill(position, radius, c, GRAIN_M, 0.5) for c in (pit, mesh))
    assert found.sand_measure == pytest.approx(box.sand_measure, rel=1e-6)
    assert found.grains_inside == box.grains_inside
    assert found.filled_depth_m == pytest.approx(box.filled_depth_m)


def test_a_mesh_is_filled_by_depth_whichever_way_it_opens() -> None:
    block = open_box((0, 0, 0), (4, 4, 10)[:3], (0, 0, 1)).space
    assert isinstance(block, Block)
    solid = TriangleMesh("hole", block.corners(), FACETS)
    position = np.array([[2.0, 2.0, 1.0], [2.0, 2.0, 3.0]])
    for opens, slab, depth_m in (((0, 0, 1), 2.0, 4.0), ((0, -1, 0), 4.0, 4.0), ((1, 0, 0), 4, 4)):
        cavity = Cavity("hole", solid, -np.array(opens, dtype=float))
        got = cavity_fill(position, np.ones(2), cavity, slab, bed_fraction=0.1)
        assert got.filled_depth_m == pytest.approx(depth_m)


def test_a_turned_cylinder_with_turned_spheres_measures_as_an_upright_one() -> None:
    rng = np.random.default_rng(8)
    position, radius = rng.uniform(-4, 4, (200, 3)), rng.uniform(0.2, 0.9, 200)
    turn, _ = np.linalg.qr(rng.normal(size=(3, 3)))
    turn *= np.linalg.det(turn)
    up = np.array([0.0, 0.0, 1.0])
    upright = Cavity("bore", cylinder_along("bore", np.zeros(3), -up, 5.0, 6.0), -up)
    leaning = Cavity("bore", cylinder_along("bore", np.ones(3), -up @ turn, 5.0, 6.0), -up @ turn)
    first = cavity_fill(position, radius, upright, 1.0, 0.5)
    second = cavity_fill(position @ turn + 1.0, radius, leaning, 1.0, 0.5)
    assert first.sand_measure == pytest.approx(second.sand_measure, rel=1e-4)
    assert first.grains_inside == second.grains_inside > 20
    assert first.filled_depth_m == pytest.approx(second.filled_depth_m)
    # the measure of the space itself is that of the circle
    assert first.fill_fraction == pytest.approx(first.sand_measure / (math.pi * 6.25 * 6.0))


def test_spheres_cut_by_a_round_wall_are_as_exact_as_is_said() -> None:
    bore = cylinder_along("bore", np.zeros(3), np.array([0.0, 0.0, 1.0]), 5.0, 60.0)
    cylinder_m, r = 2.5, 1.0
    whole = 4 / 3 * math.pi * r**3
    # slices of the sphere are discs, whose lens with the circle is exact
    z, weight = np.polynomial.legendre.leggauss(400)
    ring = np.sqrt(r**2 - z**2)
    for off_m in (1.6, 2.5, 3.2):
        slices = disc_lens_m2(np.full(400, off_m), ring, np.full(400, cylinder_m))
        for angle in (0.0, 0.3, 1.0):
            centre = off_m * np.array([[math.cos(angle), math.sin(angle), 0.0]])
            (part,) = part_in_solid(centre, np.array([r]), bore)
            assert abs(part - float(weight @ slices)) < 3e-4 * cylinder_m / r * whole
    # on the axis a sphere larger than the bore loses a ring: 4/3 pi (r^3 - (r^2 - R^2)^(3/2))
    (part,) = part_in_solid(np.zeros((1, 3)), np.array([3.0]), bore)
    exact = 4 / 3 * math.pi * (27.0 - (9.0 - 6.25) ** 1.5)
    assert part == pytest.approx(exact, rel=3e-4)


def test_an_empty_hole_is_one_void_but_for_its_corners() -> None:
    nothing = np.zeros((0, 2)), np.zeros(0)
    got = cavity_voids(*nothing, HOLE, scene(2), GRAIN_M)
    assert got.count == 1
    # a disc of radius 1 reaches into no corner: (4 - pi) of the area is out of reach
    assert got.largest_measure == pytest.approx(40 - (4 - math.pi), abs=28 * HALF_CELL_M)
    assert got.void_fraction == pytest.approx(got.largest_measure / 40)
    cube = open_box((0, 0, 0), (6, 6, 6), (0, 0, 1))
    got = cavity_voids(np.zeros((0, 3)), np.zeros(0), cube, scene(3), GRAIN_M)
    # twelve edges 4 long lose 1 - pi/4 each, the eight corners 8 - 4/3 pi together
    exact = 216 - 48 * (1 - math.pi / 4) - (8 - 4 / 3 * math.pi)
    assert (got.count, got.largest_measure) == (1, pytest.approx(exact, rel=0.01))


def test_a_disc_that_fills_the_width_parts_a_hole_into_two_voids() -> None:
    plug = np.array([[2.0, 4.0]])
    parted = cavity_voids(plug, np.array([1.9]), HOLE, scene(2), GRAIN_M)
    assert parted.count == 2
    # the upper one: 6 above the disc's middle, the lower one 4
    assert 40 * parted.void_fraction > parted.largest_measure > 20 * parted.void_fraction
    # beside a disc of radius 1 at the wall there is room for another, just not all round it
    aside = cavity_voids(np.array([[1.0, 5.0]]), np.array([0.95]), HOLE, scene(2), GRAIN_M)
    assert aside.count == 1
    web = Block("web", np.array([2.0, 5.0]), np.array([2.0, 1.0]), np.eye(2))
    cut = cavity_voids(np.zeros((0, 2)), np.zeros(0), HOLE, scene(2, web), GRAIN_M)
    assert cut.count == 2
    assert cut.largest_measure == pytest.approx(16 - (4 - math.pi), abs=16 * HALF_CELL_M)


def test_gaps_smaller_than_a_grain_are_no_voids() -> None:
    # a square lattice: a disc of radius sqrt(2) - 1 fits between four of radius 1
    position = np.array([[x, y] for x in (1.0, 3.0) for y in (1.0, 3.0, 5.0, 7.0, 9.0)])
    for grain_m, count in ((0.9, 0), (0.7, 4)):
        got = cavity_voids(position, np.ones(10), HOLE, scene(2), grain_m)
        # those between four discs; at the border there is room for smaller ones only
        assert got.count == count
    # where a disc of radius 1 is missing one of 0.85 can lie and be moved about by 0.15
    got = cavity_voids(np.delete(position, 4, axis=0), np.ones(9), HOLE, scene(2), 1.7)
    assert got.count == 1
    assert math.pi * 0.85**2 < got.largest_measure < 4.0
