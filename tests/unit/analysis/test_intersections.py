"""Common parts against closed forms, limits and symmetry."""

import numpy as np
import pytest
from numpy.testing import assert_allclose

from sandmould.analysis import intersections as cut

SQUARE = np.array([[-1.0, -1.0], [1.0, -1.0], [1.0, 1.0], [-1.0, 1.0]])
BALL = 4.0 / 3.0 * np.pi


def lens(function, distance, first, second):
    return float(function(np.array([distance]), np.array([first]), np.array([second]))[0])


def test_lens_of_unit_discs_through_each_others_centres():
    assert lens(cut.disc_lens_m2, 1.0, 1.0, 1.0) == pytest.approx(2 * np.pi / 3 - np.sqrt(3) / 2)


def test_lens_of_unit_spheres_through_each_others_centres():
    assert lens(cut.sphere_lens_m3, 1.0, 1.0, 1.0) == pytest.approx(5 * np.pi / 12)


def test_lens_of_unequal_discs_and_spheres():
    # the common chord passes through the centre of the smaller one: half of it, and a segment
    big = np.sqrt(2.0)
    assert lens(cut.disc_lens_m2, 1.0, big, 1.0) == pytest.approx(np.pi - 1.0)
    cap = np.pi / 3 * (big - 1.0) ** 2 * (2 * big + 1.0)
    assert lens(cut.sphere_lens_m3, 1.0, big, 1.0) == pytest.approx(2 * np.pi / 3 + cap)
    assert lens(cut.sphere_lens_m3, 1.0, 1.0, big) == pytest.approx(2 * np.pi / 3 + cap)


@pytest.mark.parametrize(
    ("function", "whole"), [(cut.disc_lens_m2, np.pi * 0.09), (cut.sphere_lens_m3, BALL * 0.027)]
)
def test_lens_limits(function, whole):
    assert lens(function, 1.4, 1.0, 0.3) == 0.0
    assert lens(function, 1.3, 1.0, 0.3) == pytest.approx(0.0, abs=1e-12)
    assert lens(function, 0.7, 1.0, 0.3) == pytest.approx(whole, rel=1e-7)
    assert lens(function, 0.2, 0.3, 1.0) == pytest.approx(whole)
    assert lens(function, 0.0, 1.0, 0.3) == pytest.approx(whole)
    assert lens(function, 0.0, 0.3, 0.3) == pytest.approx(whole)


def test_segment_and_cap_beyond_a_line():
    distance, r = np.array([3.0, 1.0, 0.0, -1.0, -3.0]), np.full(5, 2.0)
    segment = 4 * np.pi / 3 - np.sqrt(3.0)
    area = [0.0, segment, 2 * np.pi, 4 * np.pi - segment, 4 * np.pi]
    assert_allclose(cut.disc_segment_m2(distance, r), area, atol=1e-14)
    cap = np.pi * 5.0 / 3.0
    volume = [0.0, cap, 4 * BALL, 8 * BALL - cap, 8 * BALL]
    assert_allclose(cut.sphere_cap_m3(distance, r), volume, atol=1e-14)


@pytest.mark.parametrize("polygon", [SQUARE, SQUARE[::-1]], ids=["ccw", "cw"])
def test_disc_and_square(polygon):
    segment = float(cut.disc_segment_m2(np.array([0.3]), np.array([0.5]))[0])
    cases = [
        ((0.0, 0.0), 0.5, np.pi * 0.25),  # inside
        ((1.0, 0.2), 0.5, np.pi * 0.125),  # centred on a side
        ((-1.0, 1.0), 0.5, np.pi * 0.0625),  # centred on a corner
        ((0.1, 0.7), 0.5, np.pi * 0.25 - segment),
        ((0.1, 1.3), 0.5, segment),
        ((0.2, 0.1), 9.0, 4.0),  # round the whole square
        ((1.4, 1.4), 0.5, 0.0),  # near both sides' lines, but past the corner
        ((3.0, 0.0), 0.5, 0.0),
        ((0.0, 0.0), 1.2, 1.44 * np.pi - 4 * (1.44 * np.arccos(1 / 1.2) - np.sqrt(0.44))),
    ]
    centre, radius, area = (np.array(column) for column in zip(*cases, strict=True))
    assert_allclose(cut.disc_polygon_m2(centre, radius, polygon), area, atol=1e-14)


def test_disc_over_a_wedge_that_reaches_far():
    # a wedge of 60 degrees with its tip at the centre: a sixth of the disc
    far = 1e3
    wedge = np.array([[0.0, 0.0], [far, 0.0], [far / 2, far * np.sqrt(3) / 2]])
    area = cut.disc_polygon_m2(np.zeros((1, 2)), np.array([1e-3]), wedge)
    assert_allclose(area, np.pi * 1e-6 / 6, rtol=1e-9)


def test_parts_of_a_disc_over_a_tiling_add_up():
    corners = np.array([0.13, -0.07])
    centre, radius = np.array([[0.3, 0.2], [-0.4, 0.1], [0.0, 0.0]]), np.array([0.7, 0.9, 0.2])
    total = np.zeros(3)
    for x in (-1.0, 1.0):
        for y in (-1.0, 1.0):
            tile = corners + np.array([[0, 0], [5 * x, 0], [5 * x, 5 * y], [0, 5 * y]])
            total += cut.disc_polygon_m2(centre, radius, tile)
    assert_allclose(total, np.pi * radius**2, rtol=1e-13)


def test_cut_polygon():
    diagonal = cut.cut_polygon(SQUARE, np.zeros(2), np.array([1.0, 1.0]))
    assert cut.polygon_area_m2(diagonal) == pytest.approx(2.0)
    quarter = cut.cut_polygon(SQUARE, np.array([0.5, 0.0]), np.array([1.0, 0.0]))
    assert cut.polygon_area_m2(quarter) == pytest.approx(1.0)
    whole = cut.cut_polygon(SQUARE, np.array([-2.0, 0.0]), np.array([1.0, 0.0]))
    assert_allclose(whole, SQUARE)
    gone = cut.cut_polygon(SQUARE, np.array([2.0, 0.0]), np.array([1.0, 0.0]))
    assert len(gone) == 0
    assert_allclose(cut.disc_polygon_m2(np.zeros((1, 2)), np.ones(1), gone), 0.0)


def test_depth_in_polygon():
    points = np.array([[0.0, 0.0], [0.9, 0.2], [1.5, 0.0]])
    assert_allclose(cut.depth_in_polygon_m(points, SQUARE[::-1]), [1.0, 0.1, -0.5])


def prism(centre, radius, polygon=SQUARE, low=-1.0, high=1.0):
    centre = np.atleast_2d(np.asarray(centre, dtype=float))
    return cut.sphere_prism_m3(centre, np.full(len(centre), float(radius)), polygon, low, high)


def test_sphere_and_cube():
    ball = BALL * 0.125
    cap = np.pi / 3 * 0.2**2 * 1.3
    cases = [
        ((0.1, 0.2, -0.3), ball),
        ((0.0, 1.0, 0.0), ball / 2),
        ((0.0, 0.0, -1.0), ball / 2),
        ((1.0, 1.0, 0.0), ball / 4),
        ((1.0, 0.0, 1.0), ball / 4),
        ((-1.0, 1.0, 1.0), ball / 8),
        ((0.0, 0.7, 0.0), ball - cap),
        ((0.0, 0.0, 1.3), cap),
        ((1.4, 1.4, 0.0), 0.0),
        ((5.0, 0.0, 0.0), 0.0),
    ]
    centre, volume = zip(*cases, strict=True)
    assert_allclose(prism(centre, 0.5), volume, atol=1e-6 * ball)


def test_sphere_round_a_whole_cube_and_round_a_plate():
    assert_allclose(prism((0.1, -0.1, 0.2), 3.0), 8.0, rtol=1e-12)
    plate = np.pi / 3 * np.array([0.5**2 * 2.5, 0.2**2 * 2.8])
    part = prism((0.5, 0.0, 0.0), 1.0, polygon=np.array([[1, -9], [1.3, -9], [1.3, 9], [1, 9]]))
    assert_allclose(part, plate[0] - plate[1], rtol=1e-6)


def test_sphere_cut_in_eight_adds_up():
    rng = np.random.default_rng(5)
    centre = rng.uniform(-1.0, 1.0, (200, 3))
    total = np.zeros(200)
    for x in (-9.0, 9.0):
        for y in (-9.0, 9.0):
            for low, high in ((-9.0, 0.0), (0.0, 9.0)):
                total += prism(centre, 1.0, np.array([[0, 0], [x, 0], [x, y], [0, y]]), low, high)
    assert_allclose(total, BALL, rtol=1e-6)


def test_slicing_axis_does_not_matter():
    # the same box part, sliced along z and along x
    rng = np.random.default_rng(6)
    centre = rng.uniform(-1.5, 1.5, (400, 3))
    along_z = prism(centre, 0.8, SQUARE * [1.0, 0.5], -0.3, 0.3)
    along_x = prism(centre[:, [1, 2, 0]], 0.8, SQUARE * [0.5, 0.3], -1.0, 1.0)
    assert_allclose(along_z, along_x, rtol=1e-6, atol=1e-12)


def test_prism_in_portions(monkeypatch):
    centre = np.random.default_rng(7).uniform(-1.5, 1.5, (50, 3))
    at_once = prism(centre, 0.8)
    monkeypatch.setattr(cut, "_CHUNK", 7)
    assert_allclose(prism(centre, 0.8), at_once, rtol=1e-14)
