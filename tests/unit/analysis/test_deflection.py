"""Deflection of outlines whose answer is plain."""

from __future__ import annotations

import numpy as np
import pytest

from sandmould.analysis.deflection import deflection, farthest_corner, fill_under

L_M = np.array([[0, 0], [2, 0], [2, 8], [12, 8], [12, 10], [0, 10]], dtype=float)
FOOT_M = L_M[:2]


def test_the_tip_of_an_l_is_the_upper_corner_of_its_flange() -> None:
    assert farthest_corner(L_M, FOOT_M) == 4


def test_of_two_ends_of_a_t_the_right_one_is_taken() -> None:
    t_m = np.array([[5, 0], [7, 0], [7, 8], [12, 8], [12, 10], [0, 10], [0, 8], [5, 8]], float)
    t_m[5, 0] -= 1e-12  # round-off
    assert farthest_corner(t_m, t_m[:2]) == 4


def test_a_pattern_that_nothing_holds_has_no_farthest_corner() -> None:
    with pytest.raises(ValueError, match="points that hold the pattern are 0"):
        farthest_corner(L_M, L_M[:0])


def test_a_tip_that_sinks_deflects() -> None:
    now_m = L_M.copy()
    now_m[4] += [0.3, -0.4]
    now_m[2] += [0.6, 0.0]
    found = deflection(L_M, now_m, 4)
    assert found.tip_m == pytest.approx(0.4)
    assert found.largest_m == pytest.approx(0.6)


def test_sand_under_a_flange_is_told_from_sand_beside_above_and_in_it() -> None:
    # The space under the flange is 10 x 8; centres in it count, on edges and corners of x too.
    places_m = np.array([[5, 1], [11, 7], [2, 3], [1, 11], [5, 11], [13, 1], [-1, 5], [5, 9]])
    found = fill_under(L_M, places_m.astype(float), np.arange(1.0, 9.0))
    assert found == pytest.approx(np.pi * (1 + 4 + 9) / 80.0)
    whole = fill_under(L_M, np.zeros((0, 2)), np.zeros(0))
    assert whole == 0.0


def test_the_space_under_a_bent_flange_is_smaller() -> None:
    sunk_m = L_M - [[0, 0], [0, 0], [0, 0], [0, 2], [0, 2], [0, 0]]
    disc = np.array([[3.0, 7.5]]), np.array([1.0])
    # A tenth of the strips' width is all that a sloping edge may cost.
    assert fill_under(sunk_m, *disc) == pytest.approx(np.pi / 70.0, rel=1e-3)
    assert fill_under(sunk_m, np.array([[11.0, 6.5]]), np.array([1.0])) == 0.0


def test_a_point_in_the_foot_of_a_c_is_not_under_its_top() -> None:
    c_m = np.array([[0, 0], [9, 0], [9, 2], [2, 2], [2, 8], [9, 8], [9, 10], [0, 10]], dtype=float)
    places_m = np.array([[5.0, 1.0], [5.0, 5.0]])
    assert fill_under(c_m, places_m, np.array([3.0, 1.0])) == pytest.approx(np.pi / 42.0)


def test_a_block_on_the_floor_has_nothing_under_it() -> None:
    block_m = np.array([[0, 0], [2, 0], [2, 3], [0, 3]], dtype=float)
    assert np.isnan(fill_under(block_m, np.array([[1.0, 4.0]]), np.array([0.5])))
