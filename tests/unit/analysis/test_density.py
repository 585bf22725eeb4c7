"""Equation (55) against lattices and walls worked out by hand for (55) itself."""

import numpy as np
import pytest
from numpy.testing import assert_allclose
from scipy.spatial.distance import pdist, squareform

from sandmould.analysis.density import apparent_density
from sandmould.engines import neighbours
from sandmould.geometry.geometry import Block, Scene, Wall

RHO = 2400.0


def lattice(*steps, count):
    """Points of a lattice round the origin; the origin's index."""
    index = np.stack(np.meshgrid(*[np.arange(-count, count + 1)] * len(steps), indexing="ij"), -1)
    points = index.reshape(-1, len(steps)) @ np.array(steps, dtype=float)
    return points, len(points) // 2


def shares(distance, dimension):
    """Part of a unit disc or sphere in a control volume of radius 2, over that volume."""
    x = (distance**2 + 3.0) / (2.0 * distance)
    y = distance - x
    if dimension == 2:
        control = 4.0 * np.arccos(x / 2.0) - x * np.sqrt(4.0 - x**2)
        return (control + np.arccos(y) - y * np.sqrt(1.0 - y**2)) / (4.0 * np.pi)
    caps = (2.0 - x) ** 2 * (4.0 + x) + (1.0 - y) ** 2 * (2.0 + y)
    return caps / 32.0


def scene(dimension, walls=(), blocks=()):
    return Scene(dimension, tuple(walls), tuple(blocks), ())


def wall(point, normal):
    return Wall("wall", np.array(point, dtype=float), np.array(normal, dtype=float))


def one_grain(at, of):
    """Density of a single grain of radius 1."""
    return apparent_density(np.array([at], dtype=float), np.ones(1), RHO, of)


def test_hexagonal_discs():
    position, centre = lattice([2.0, 0.0], [1.0, np.sqrt(3.0)], count=4)
    raw = apparent_density(position, np.ones(len(position)), RHO).raw_kg_m3[centre]
    # itself and six neighbours at two radii; the next are at 3.46, out of reach
    expected = 0.25 + 6.0 * shares(2.0, 2)
    assert raw / RHO == pytest.approx(expected, rel=1e-12)
    assert expected == pytest.approx(0.920, abs=5e-4)
    assert np.pi / np.sqrt(12.0) == pytest.approx(0.907, abs=5e-4)


def test_square_discs():
    position, centre = lattice([2.0, 0.0], [0.0, 2.0], count=3)
    raw = apparent_density(position, np.ones(len(position)), RHO).raw_kg_m3[centre]
    expected = 0.25 + 4.0 * shares(2.0, 2) + 4.0 * shares(np.sqrt(8.0), 2)
    assert raw / RHO == pytest.approx(expected, rel=1e-12)


def test_simple_cubic_spheres():
    position, centre = lattice([2.0, 0, 0], [0, 2.0, 0], [0, 0, 2.0], count=2)
    raw = apparent_density(position, np.ones(len(position)), RHO).raw_kg_m3[centre]
    expected = 1.0 / 8.0 + 6.0 * shares(2.0, 3) + 12.0 * shares(np.sqrt(8.0), 3)
    assert raw / RHO == pytest.approx(expected, rel=1e-12)


def test_scale_and_order_of_grains_do_not_matter():
    position, _ = lattice([2.0, 0.0], [1.0, np.sqrt(3.0)], count=3)
    radius = np.ones(len(position))
    raw = apparent_density(position, radius, RHO).raw_kg_m3
    shuffle = np.random.default_rng(0).permutation(len(position))
    small = apparent_density(1e-3 * position[shuffle], 1e-3 * radius, RHO).raw_kg_m3
    assert_allclose(small, raw[shuffle], rtol=1e-12)


def test_two_unequal_grains_and_a_given_control_radius():
    position, radius = np.array([[0.0, 0.0], [3.0, 0.0]]), np.array([2.0, 1.0])
    default = apparent_density(position, radius, RHO)
    # twice the largest radius, 4: each holds the other whole, or cut by a chord
    assert default.raw_kg_m3[0] == pytest.approx(RHO * (4.0 + 1.0) / 16.0)
    x = (9.0 + 16.0 - 4.0) / 6.0
    part = 16 * np.arccos(x / 4) - x * np.sqrt(16 - x**2)
    y = 3.0 - x
    part += 4 * np.arccos(y / 2) - y * np.sqrt(4 - y**2)
    assert default.raw_kg_m3[1] == pytest.approx(RHO * (np.pi + part) / (16 * np.pi))
    wide = apparent_density(position, radius, RHO, control_radius_m=10.0)
    assert_allclose(wide.raw_kg_m3, RHO * 0.05, rtol=1e-12)
    assert_allclose(wide.corrected_kg_m3, wide.raw_kg_m3)
    assert_allclose(wide.free_fraction, 1.0)


def test_disc_on_a_floor_and_in_a_corner():
    floor, side = wall([5, 0], [0, 1]), wall([0, 7], [1, 0])
    outside = 4 * np.pi / 3 - np.sqrt(3.0)
    on_floor = one_grain([9.0, 1.0], scene(2, [floor, side]))
    assert on_floor.free_fraction[0] == pytest.approx(1 - outside / (4 * np.pi))
    assert on_floor.raw_kg_m3[0] == pytest.approx(RHO / 4)
    assert on_floor.corrected_kg_m3[0] == pytest.approx(RHO * np.pi / (4 * np.pi - outside))
    # quarter disc, two strips of width 1 and the square towards the corner
    corner = one_grain([1.0, 1.0], scene(2, [floor, side]))
    free = np.pi + 2 * (np.sqrt(3.0) / 2 + np.pi / 3) + 1.0
    assert corner.free_fraction[0] == pytest.approx(free / (4 * np.pi))


@pytest.mark.parametrize("angle", [0.0, 0.4, 1.2])
def test_disc_beside_a_plate_at_any_angle(angle):
    c, s = np.cos(angle), np.sin(angle)
    axes = np.array([[c, s], [-s, c]])
    plate = Block("plate", 1.25 * axes[0], np.array([0.25, 40.0]), axes)
    removed = 4 * np.pi / 3 - np.sqrt(3.0)  # beyond 1
    removed -= 4 * np.arccos(0.75) - 1.5 * np.sqrt(4 - 2.25)  # beyond 1.5
    free = one_grain([0.0, 0.0], scene(2, blocks=[plate])).free_fraction[0]
    assert free == pytest.approx(1 - removed / (4 * np.pi))


def test_block_through_a_wall_is_subtracted_inside_the_box_only():
    floor = wall([0, 0], [0, 1])
    sunk = Block("sunk", np.array([3.0, 0.0]), np.array([2.0, 30.0]), np.eye(2))
    free = one_grain([0.0, 0.0], scene(2, [floor], [sunk])).free_fraction[0]
    beyond = 4 * np.pi / 3 - np.sqrt(3.0)
    assert free == pytest.approx((2 * np.pi - beyond / 2) / (4 * np.pi))
    floor = wall([0, 0, 0], [0, 0, 1])
    sunk = Block("sunk", np.array([3.0, 0.0, 0.0]), np.array([2.0, 30.0, 30.0]), np.eye(3))
    free = one_grain([0.0, 0.0, 0.0], scene(3, [floor], [sunk])).free_fraction[0]
    assert free == pytest.approx(0.5 - 0.5 * 5 / 32, rel=1e-6)


def test_sphere_at_walls():
    floor, left, back = (
        wall([0, 0, 0], [0, 0, 1]),
        wall([0] * 3, [1, 0, 0]),
        wall([0] * 3, [0, 1, 0]),
    )
    box = scene(3, [floor, left, back])
    at = [[9, 9, 1], [1, 9, 9], [0, 9, 0], [0, 0, 0], [9, 9, 9]]
    cap = 5.0 / 32.0  # pi/3 (2-1)^2 (4+1) over the sphere of radius 2
    got = [one_grain(p, box).free_fraction[0] for p in at]
    assert_allclose(got, [1 - cap, 1 - cap, 0.25, 0.125, 1.0], rtol=1e-6)
    oblique = wall([0, 0, 0], [0, 0.6, 0.8])
    with pytest.raises(ValueError, match="oblique"):
        one_grain([1, 1, 1], scene(3, [oblique]))


def test_sphere_beside_a_tilted_plate():
    axes = np.linalg.qr(np.random.default_rng(2).normal(size=(3, 3)))[0]
    plate = Block("plate", 1.25 * axes[1], np.array([40.0, 0.25, 40.0]), axes)
    removed = (1.0 * 5.0 - 0.25 * 5.5) / 32.0
    free = one_grain([0.0, 0.0, 0.0], scene(3, blocks=[plate])).free_fraction[0]
    assert free == pytest.approx(1 - removed, rel=1e-6)


def test_no_free_space_gives_nan_and_overlapping_blocks_do_not_go_negative():
    block = Block("block", np.zeros(2), np.array([1.5, 50.0]), np.eye(2))
    got = one_grain([0.0, 0.0], scene(2, blocks=[block, block]))
    assert got.free_fraction[0] == 0.0
    assert np.isnan(got.corrected_kg_m3[0])
    assert got.raw_kg_m3[0] == pytest.approx(RHO / 4)


def test_no_grains():
    got = apparent_density(np.zeros((0, 2)), np.zeros(0), RHO, scene(2, [wall([0, 0], [0, 1])]))
    assert len(got.raw_kg_m3) == len(got.corrected_kg_m3) == 0


@pytest.mark.parametrize("dimension", [2, 3])
def test_near_pairs_in_portions_match_brute_force(dimension, monkeypatch):
    monkeypatch.setattr(neighbours, "_CHUNK", 7)
    position = np.random.default_rng(4).uniform(0.0, 1.0, (60, dimension))
    seen = []
    for first, second, distance in neighbours.near_pairs(position, 0.3):
        gap = np.linalg.norm(position[first] - position[second], axis=1)
        assert_allclose(distance, gap)
        seen += [tuple(sorted(pair)) for pair in zip(first.tolist(), second.tolist(), strict=True)]
    near = np.argwhere(np.triu(squareform(pdist(position)) <= 0.3, 1))
    assert sorted(seen) == [tuple(pair) for pair in near.tolist()]
