"""Three grains by hand: one inside, one cut in half by the mouth, one outside."""

import numpy as np
import pytest
from numpy.testing import assert_allclose

from sandmould.analysis.tube_fill import sand_in_bore, tube_fill
from sandmould.geometry.geometry import Bore

ANGLE = 0.5
C, S = np.cos(ANGLE), np.sin(ANGLE)


def tube_2d():
    """A tilted bore, 3 wide (off its mouth's centre by 0.5) and 10 long."""
    axis, across = np.array([C, S]), np.array([[-S, C]])
    return Bore("tube", np.array([4.0, 7.0]), axis, 10.0, across, np.array([[-1.0], [2.0]]))


def tube_3d():
    """A tilted bore of 4 x 3 and 10 long."""
    axis, across = np.array([C, 0.0, S]), np.array([[-S, 0.0, C], [0.0, -1.0, 0.0]])
    section = np.array([[-2.0, -1.5], [2.0, -1.5], [2.0, 1.5], [-2.0, 1.5]])
    return Bore("tube", np.array([4.0, 7.0, 1.0]), axis, 10.0, across, section)


def at(bore, depth, *across):
    return bore.mouth_m + depth * bore.axis + np.array(across) @ bore.basis


@pytest.mark.parametrize(("bore", "grain"), [(tube_2d(), np.pi), (tube_3d(), 4 * np.pi / 3)])
def test_three_grains(bore, grain):
    zeros = [0.0] * (len(bore.axis) - 1)
    position = np.array([at(bore, 3.0, *zeros), at(bore, 0.0, *zeros), at(bore, -2.0, *zeros)])
    got = tube_fill(position, np.ones(3), bore)
    assert got.sand_measure == pytest.approx(1.5 * grain, rel=1e-6)
    measure = 30.0 if len(bore.axis) == 2 else 120.0
    assert got.fill_fraction == pytest.approx(1.5 * grain / measure, rel=1e-6)
    assert got.front_depth_m == pytest.approx(4.0)
    only_mouth = tube_fill(position[1:], np.ones(2), bore)
    assert only_mouth.front_depth_m == pytest.approx(1.0)
    assert_allclose(sand_in_bore(position, np.ones(3), bore), [grain, grain / 2, 0.0], atol=1e-6)


@pytest.mark.parametrize("bore", [tube_2d(), tube_3d()])
def test_centres_inside_and_grains_outside_the_tubes_wall(bore):
    one = [0.0] * (len(bore.axis) - 2)
    position = np.array(
        [
            at(bore, 0.1, 0.0, *one),
            at(bore, -0.1, 0.0, *one),
            at(bore, 9.9, 0.0, *one),
            at(bore, 10.1, 0.0, *one),
            at(bore, 5.0, 3.4, *one),  # on the outside of a wall 0.5 thick, and pressed into it
            at(bore, -0.2, 2.9, *one),  # on the rim of the wall
        ]
    )
    radius = np.ones(6)
    got = tube_fill(position, radius, bore)
    assert got.grains_inside == 2
    assert got.front_depth_m == pytest.approx(10.0)
    part = sand_in_bore(position, radius, bore)
    assert part[4] == 0.0
    # it slips round the rim, so its small part counts, but it is no front
    assert 0.0 < part[5] < 0.02
    alone = tube_fill(position[5:], radius[5:], bore)
    assert alone.front_depth_m == 0.0
    assert alone.grains_inside == 0


def test_empty_tube():
    got = tube_fill(np.zeros((0, 2)), np.zeros(0), tube_2d())
    assert (got.sand_measure, got.fill_fraction, got.grains_inside, got.front_depth_m) == (0,) * 4
