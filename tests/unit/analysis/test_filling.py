"""Filling of a cavity: levels and limbs against planted ones."""

from __future__ import annotations

import math

import numpy as np
import pytest

from sandmould.analysis.spectrum import fit_limbs

F_HZ = np.array([10.0, 20.0, 40.0, 80.0, 160.0])


def test_both_limbs_of_a_planted_curve() -> None:
    y = np.where(F_HZ <= 40, F_HZ**2, 1600 * (F_HZ / 40) ** -1.5)
    limbs = fit_limbs(F_HZ, y, 0.05 * y)
    assert limbs.turn == 40
    assert limbs.rise is not None
    assert limbs.fall is not None
    assert limbs.rise.exponent == pytest.approx(2.0)
    assert limbs.fall.exponent == pytest.approx(-1.5)
    # three points an octave apart, each to 5 %: the textbook error of a slope
    assert limbs.fall.se == pytest.approx(0.05 / (math.log(2) * math.sqrt(2)))


def test_scatter_beyond_the_errors_widens_them() -> None:
    y = np.array([1.0, 0.9, 0.5, 0.45, 0.2])
    limbs = fit_limbs(F_HZ, y, 1e-4 * y)
    assert limbs.rise is None
    assert limbs.fall is not None
    assert limbs.fall.points == 5
    assert limbs.fall.se > 0.05


def test_order_of_points_and_lost_ones_do_not_matter() -> None:
    y = 3 * F_HZ**-0.7
    back = fit_limbs(F_HZ[::-1], y[::-1], np.full(5, math.nan)).fall
    assert back is not None
    assert back.exponent == pytest.approx(-0.7)
    some = fit_limbs(F_HZ, np.where(F_HZ == 40, -0.01, y), 0.1 * y).fall
    assert some is not None
    assert (some.points, some.exponent) == (4, pytest.approx(-0.7))
    with pytest.raises(ValueError, match="positive"):
        fit_limbs(F_HZ, -y, y)
