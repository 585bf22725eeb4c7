"""Shares of layers by hand; the mixing index at its extremes."""

import numpy as np
import pytest
from numpy.testing import assert_allclose

from sandmould.analysis.tube_fill import mixing_index, tube_shares
from sandmould.geometry.geometry import Bore


def square_lattice(side):
    return np.stack(np.meshgrid(np.arange(side), np.arange(side)), -1).reshape(-1, 2).astype(float)


def test_shares_of_the_sand_in_a_tube():
    position = np.array([[1.0, 1.0], [3.0, 2.0], [1.0, 6.0], [12.0, 1.0]])
    radius, layer = np.array([1.0, 2.0, 1.0, 1.0]), np.array([1, 1, 2, 4])
    bore = Bore("tube", np.zeros(2), np.array([0.0, 1.0]), 8.0, np.array([[1.0, 0.0]]),
                np.array([[0.0], [10.0]]))  # fmt: skip
    got = tube_shares(position, radius, layer, bore)
    assert list(got) == [1, 2, 4]
    assert_allclose(list(got.values()), [5 / 6, 1 / 6, 0.0], rtol=1e-12)
    empty = Bore("far", np.full(2, 99.0), bore.axis, 8.0, bore.basis, bore.section_m)
    assert tube_shares(position, radius, layer, empty) == {}


def test_layers_as_filled_score_their_interface():
    position = square_lattice(40)
    layer = 1 + (position[:, 1] >= 20).astype(np.int64)
    assert 0.0 < mixing_index(position, layer) < 0.1


def test_dealt_out_at_random_scores_one():
    position = square_lattice(40)
    layer = 1 + (position[:, 1] // 10).astype(np.int64)
    shuffled = position[np.random.default_rng(8).permutation(len(position))]
    assert mixing_index(shuffled, layer) == pytest.approx(1.0, abs=0.03)


def test_half_of_the_bed_mixed_scores_about_a_half():
    position = square_lattice(40)
    layer = 1 + (position[:, 1] >= 20).astype(np.int64)
    moved = position.copy()
    left = np.flatnonzero(position[:, 0] < 20)
    moved[left] = position[np.random.default_rng(9).permutation(left)]
    assert mixing_index(moved, layer) == pytest.approx(0.5, abs=0.05)


def test_three_grains_that_all_neighbour_each_other():
    # u = (1/2 + 1/2 + 1)/3 is what chance gives, whatever the places
    position = np.array([[0.0, 0.0], [1.0, 0.0], [9.0, 3.0]])
    assert mixing_index(position, np.array([1, 1, 2])) == pytest.approx(1.0)


def test_one_layer():
    assert mixing_index(square_lattice(5), np.ones(25, dtype=np.int64)) == 0.0
