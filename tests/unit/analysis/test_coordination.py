"""Contacts of small patches counted by hand."""

import numpy as np
import pytest
from numpy.testing import assert_array_equal

from sandmould.analysis.coordination import contacts
from sandmould.geometry.geometry import Block, Scene, Wall
from sandmould.geometry.outline import Outline
from sandmould.geometry.revolved import Revolved


def hexagon():
    angle = np.arange(6) * np.pi / 3
    return np.vstack([np.zeros((1, 2)), 2.0 * np.column_stack([np.cos(angle), np.sin(angle)])])


def test_hexagonal_patch():
    got = contacts(hexagon(), np.full(7, 1.01))
    assert_array_equal(got.count, [6, 3, 3, 3, 3, 3, 3])
    assert (got.grain_grain, got.grain_wall) == (12, 0)
    assert got.mean_coordination == pytest.approx(24 / 7)
    assert got.largest_overlap_fraction == pytest.approx(0.02 / 1.01)
    assert got.overlap_p99_fraction == pytest.approx(0.02 / 1.01)


def test_tolerance_closes_small_gaps_and_no_larger_ones():
    apart = np.full(7, 0.99)
    assert contacts(hexagon(), apart).grain_grain == 0
    assert contacts(hexagon(), apart).largest_overlap_fraction == 0.0
    assert contacts(hexagon(), apart, tolerance_m=0.021).grain_grain == 12
    assert contacts(hexagon(), apart, tolerance_m=0.019).grain_grain == 0


def test_overlap_that_99_of_100_contacts_do_not_exceed():
    """A row of 102 grains of radius 1 has 101 contacts, k of them 0.001 k deep: the 99 % is 0.1."""
    depth = 0.001 * np.arange(1, 102)
    x = np.concatenate([[0.0], np.cumsum(2.0 - depth)])
    row = np.column_stack([x, np.zeros(102)])
    got = contacts(row, np.ones(102))
    # 99 % of the way from the first to the last of 101 sorted depths is the 100th.
    assert got.overlap_p99_fraction == pytest.approx(0.1)
    assert got.largest_overlap_fraction == pytest.approx(0.101)
    # A floor that all 102 press 0.02 deep counts too: of 203 depths the 201st to 202nd.
    floor = Scene(2, (Wall("floor", np.array([0.0, -0.98]), np.array([0.0, 1.0])),), (), ())
    assert contacts(row, np.ones(102), floor).overlap_p99_fraction == pytest.approx(0.09898)
    assert contacts(row[:1], np.ones(1)).overlap_p99_fraction == 0.0


def test_rattlers_are_left_out():
    position = np.vstack([hexagon(), [[3.9, 0.0], [9.0, 9.0]]])  # one hangs on, one flies
    got = contacts(position, np.full(9, 1.01))
    assert_array_equal(got.count, [6, 4, 3, 3, 3, 3, 3, 1, 0])
    assert got.bearing_fraction == pytest.approx(7 / 9)
    assert got.mean_coordination == pytest.approx(26 / 9)
    assert got.mean_coordination_bearing == pytest.approx(25 / 7)


def test_in_3d_three_contacts_bear():
    tetrahedron = np.array([[1, 1, 1], [1, -1, -1], [-1, 1, -1], [-1, -1, 1]]) / np.sqrt(2)
    got = contacts(tetrahedron, np.full(4, 1.001))
    assert_array_equal(got.count, [3, 3, 3, 3])
    assert got.bearing_fraction == 1.0
    chain = contacts(np.array([[0, 0, 0], [2, 0, 0], [4, 0, 0]], dtype=float), np.full(3, 1.001))
    assert_array_equal(chain.count, [1, 2, 1])
    assert chain.bearing_fraction == 0.0
    assert np.isnan(chain.mean_coordination_bearing)


def test_walls_and_blocks():
    floor = Wall("floor", np.zeros(2), np.array([0.0, 1.0]))
    side = Wall("side", np.zeros(2), np.array([1.0, 0.0]))
    block = Block("block", np.array([4.0, 1.0]), np.array([1.0, 1.0]), np.eye(2))
    scene = Scene(2, (floor, side), (block,), ())
    position, radius = np.array([[0.9, 0.8], [2.5, 1.0]]), np.array([1.0, 0.5])
    got = contacts(position, radius, scene)
    # the corner grain presses on both walls, the small one just touches the block: no contact
    assert_array_equal(got.count, [2, 0])
    assert (got.grain_grain, got.grain_wall) == (0, 2)
    assert got.largest_overlap_fraction == pytest.approx(0.2)
    pressed = contacts(position + np.full(2, 0.3), radius, scene)
    assert_array_equal(pressed.count, [0, 1])
    assert pressed.largest_overlap_fraction == pytest.approx(0.3 / 0.5)


def test_other_solids_count_once_each():
    notch = np.array([[0, 0], [6, 0], [6, 4], [4, 4], [4, 1], [2, 1], [2, 4], [0, 4]], dtype=float)
    scene = Scene(2, (), (), (), (Outline("u", notch),))
    # in the notch, touching its floor and both legs; beside the left leg; away
    got = contacts(np.array([[3.0, 2.0], [-0.9, 2.0], [9, 9]]), np.full(3, 1.01), scene)
    assert_array_equal(got.count, [1, 1, 0])
    assert got.largest_overlap_fraction == pytest.approx(0.11 / 1.01)
    rod = Revolved("rod", np.zeros(3), np.eye(3)[0],
                   np.array([[0.0, 0], [4, 0], [4, 1], [0, 1]]))  # fmt: skip
    position, radius = (
        np.array([[1.0, 0, 1.9], [3.5, 0, 2.1], [5.5, 0.5, 0]]),
        np.array([1, 1, 1.6]),
    )
    for solids in ({"revolved": (rod,)}, {"meshes": (rod.mesh(),)}):
        scene = Scene(3, (), (), (), **solids)
        assert_array_equal(contacts(position, radius, scene).count, [1, 0, 1])
        assert_array_equal(contacts(position, radius, scene, 0.2).count, [1, 1, 1])


def test_overlap_is_taken_over_the_smaller_radius():
    got = contacts(np.array([[0.0, 0.0], [2.4, 0.0]]), np.array([2.0, 0.5]))
    assert got.largest_overlap_fraction == pytest.approx(0.1 / 0.5)


def test_no_grains():
    got = contacts(np.zeros((0, 3)), np.zeros(0))
    assert got.grain_grain == 0
    assert np.isnan(got.mean_coordination)


@pytest.mark.parametrize("dimension", [2, 3])
def test_contacts_of_mixed_sizes_equal_a_search_of_all_pairs(dimension: int) -> None:
    rng = np.random.default_rng(5)
    radius = rng.choice([0.5, 0.9, 1.0, 2.25], size=300)
    position = rng.uniform(0, 14 if dimension == 2 else 8, size=(300, dimension))
    distance = np.linalg.norm(position[:, None] - position[None], axis=2)
    overlap = radius[:, None] + radius[None] - distance
    np.fill_diagonal(overlap, -1)
    found = contacts(position, radius)
    np.testing.assert_array_equal(found.count, (overlap > 0).sum(axis=1))
    share = overlap / np.minimum(radius[:, None], radius[None])
    assert found.largest_overlap_fraction == pytest.approx(share.max())
