"""Solid fraction of slabs and the bed's surface, from a few grains placed by hand."""

import numpy as np
import pytest
from numpy.testing import assert_allclose
from scipy.spatial import ConvexHull

from sandmould.analysis.free_space import free_measure_between
from sandmould.analysis.solid_fraction import (
    bed_surface_height_m,
    mean_solid_fraction,
    solid_fraction_profile,
)
from sandmould.geometry.geometry import Block, Scene, Wall


def box(size, blocks=()):
    """Box of the given width (2D) or of width and depth (3D), floor at 0, open at the top."""
    d = len(size) + 1
    walls = [Wall("floor", np.zeros(d), np.eye(d)[-1])]
    for k, width in enumerate(size):
        walls.append(Wall(f"low {k}", np.zeros(d), np.eye(d)[k]))
        walls.append(Wall(f"high {k}", width * np.eye(d)[k], -np.eye(d)[k]))
    return Scene(d, tuple(walls), tuple(blocks), ())


def turned(angle):
    c, s = np.cos(angle), np.sin(angle)
    return np.array([[c, s], [-s, c]])


def test_disc_cut_in_half_by_the_window():
    position, radius = np.array([[2.0, 3.0], [5.0, 1.0]]), np.ones(2)
    got = mean_solid_fraction(position, radius, box([10.0]), 0.0, 3.0)
    assert got == pytest.approx(1.5 * np.pi / 30.0)
    segment = np.pi / 3 - np.sqrt(3.0) / 4
    got = mean_solid_fraction(position, radius, box([10.0]), 1.5, 2.5)
    assert got == pytest.approx((segment + segment) / 10.0)


def test_sphere_cut_in_half_by_the_window():
    position, radius = np.array([[2.0, 2.0, 3.0]]), np.ones(1)
    got = mean_solid_fraction(position, radius, box([4.0, 5.0]), 1.0, 3.0)
    assert got == pytest.approx(2 * np.pi / 3 / 40.0)


@pytest.mark.parametrize("size", [[1.0], [1.0, 0.7]], ids=["2D", "3D"])
def test_profile_adds_up_to_all_the_sand(size):
    rng = np.random.default_rng(1)
    d = len(size) + 1
    position, radius = rng.uniform(0.1, 0.5, (300, d)), rng.uniform(0.01, 0.05, 300)
    profile = solid_fraction_profile(position, radius, box(size), np.linspace(0.0, 0.6, 14))
    measure = np.pi * radius**2 if d == 2 else 4 / 3 * np.pi * radius**3
    assert profile.sand_measure.sum() == pytest.approx(measure.sum(), rel=1e-12)
    assert_allclose(profile.free_measure, np.prod(size) * 0.6 / 13)
    assert_allclose(profile.solid_fraction, profile.sand_measure / profile.free_measure)
    assert profile.height_m[0] == pytest.approx(0.3 / 13)


def test_blocks_leave_less_free_space():
    # a square on its corner, diagonal 2: triangles of area 1/4 at its tips
    square = Block("square", np.array([5.0, 2.0]), np.full(2, np.sqrt(0.5)), turned(np.pi / 4))
    scene = box([10.0], [square])
    free = free_measure_between(scene, np.array([0.0, 1.0, 1.5, 2.0, 3.0]))
    assert_allclose(free, [10.0, 5.0 - 0.25, 5.0 - 0.75, 10.0 - 1.0], rtol=1e-12)
    # the same prism in 3D, tilted about the y axis
    axes = np.array([[np.sqrt(0.5), 0, np.sqrt(0.5)], [0, 1, 0], [-np.sqrt(0.5), 0, np.sqrt(0.5)]])
    half = np.array([np.sqrt(0.5), 1.5, np.sqrt(0.5)])
    scene = box([10.0, 4.0], [Block("prism", np.array([5.0, 2.0, 2.0]), half, axes)])
    free = free_measure_between(scene, np.array([0.0, 1.0, 1.5, 2.0, 3.0]))
    assert_allclose(free, [40.0, 20.0 - 0.75, 20.0 - 2.25, 40.0 - 3.0], rtol=1e-12)


def test_upright_block_turned_about_the_vertical_and_sunk_into_a_wall():
    axes = np.eye(3)
    axes[:2, :2] = turned(np.pi / 4)
    half = np.array([np.sqrt(0.5), np.sqrt(0.5), 2.0])
    scene = box([10.0, 4.0], [Block("pillar", np.array([0.0, 2.0, 0.0]), half, axes)])
    # half of its section, of area 2, lies in the box; only its upper half stands above the floor
    free = free_measure_between(scene, np.array([-1.0, 0.0, 1.0, 3.0]))
    assert_allclose(free, [0.0, 40.0 - 1.0, 80.0 - 1.0], rtol=1e-12)


@pytest.mark.parametrize("seed", [0, 1, 2])
def test_tilted_cuboid_against_the_hull_of_its_lower_part(seed):
    rng = np.random.default_rng(seed)
    axes = np.linalg.qr(rng.normal(size=(3, 3)))[0]
    block = Block("cuboid", np.array([5.0, 5.0, 5.0]), np.array([1.0, 0.6, 0.3]), axes)
    corners = block.corners()
    one, two = np.triu_indices(8, 1)
    for height in (4.6, 5.0, 5.3):
        a, b = corners[one], corners[two]
        crossed = (a[:, 2] - height) * (b[:, 2] - height) < 0
        a, b = a[crossed], b[crossed]
        on_plane = a + ((height - a[:, 2]) / (b[:, 2] - a[:, 2]))[:, None] * (b - a)
        lower = ConvexHull(np.concatenate([corners[corners[:, 2] < height], on_plane])).volume
        free = free_measure_between(box([10.0, 10.0], [block]), np.array([0.0, height, 9.0]))
        assert 100.0 * height - free[0] == pytest.approx(lower, rel=1e-9)
        assert 100.0 * (9.0 - height) - free[1] == pytest.approx(8 * 0.18 - lower, rel=1e-9)


def test_no_free_space_is_nan_and_wrong_input_is_refused():
    block = Block("full", np.array([5.0, 1.0]), np.array([6.0, 1.0]), np.eye(2))
    scene = box([10.0], [block])
    assert np.isnan(mean_solid_fraction(np.ones((1, 2)), np.ones(1), scene, 0.0, 2.0))
    with pytest.raises(ValueError, match="rising"):
        mean_solid_fraction(np.ones((1, 2)), np.ones(1), scene, 2.0, 2.0)
    for whole in (box([10.0]), box([10.0, 10.0])):
        open_box = Scene(whole.dimension, whole.walls[:-1], (), ())
        with pytest.raises(ValueError, match="open at a side"):
            free_measure_between(open_box, np.array([0.0, 1.0]))


def column(x, tops):
    """Touching discs of radius 1 at one place across, tops one diameter apart."""
    return [[x, top - 1.0] for top in tops]


def test_bed_surface_is_the_mean_over_columns():
    position = np.array(column(1.0, [2, 4, 6]) + column(3.0, [2]) + column(5.0, [2, 4]))
    radius = np.ones(len(position))
    scene = box([8.0])  # the last column, of width 2, is bare
    assert bed_surface_height_m(position, radius, scene, 2.0) == pytest.approx(4.0)
    flying = np.array([[5.0, 30.0]])
    with_one = bed_surface_height_m(np.vstack([position, flying]), np.ones(7), scene, 2.0)
    assert with_one == pytest.approx(4.0)
    assert np.isnan(bed_surface_height_m(np.zeros((0, 2)), np.zeros(0), scene))


def test_columns_are_four_largest_radii_wide_unless_given():
    position = np.array(column(1.0, [2, 4, 6]) + column(3.5, [2]) + column(9.0, [2, 4]))
    radius, scene = np.ones(len(position)), box([12.0])
    assert bed_surface_height_m(position, radius, scene) == pytest.approx((6 + 4) / 2)
    assert bed_surface_height_m(position, radius, scene, 3.0) == pytest.approx((6 + 2 + 4) / 3)


def test_bed_surface_in_3d():
    position = np.array([[1, 1, 1], [3, 1, 1], [1, 3, 1], [3, 3, 1], [3, 3, 3]], dtype=float)
    got = bed_surface_height_m(position, np.ones(5), box([4.0, 4.0]), 2.0)
    assert got == pytest.approx((2 + 2 + 2 + 4) / 4)
