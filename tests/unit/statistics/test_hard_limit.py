"""Limits in 1/kappa: lines worked out by hand, and what has none."""

from __future__ import annotations

import math

import numpy as np
import pytest

from sandmould.statistics.hard_limit import extrapolate

KAPPA = np.array([500.0, 1000.0, 2000.0, 4000.0])
SE = np.full(4, 0.001)


def test_levels_on_a_line_have_its_intercept() -> None:
    """0.82 + 5/kappa; the error of an intercept with equal errors s is s sqrt(sum x^2/(n Sxx))."""
    found = extrapolate(KAPPA, 0.82 + 5.0 / KAPPA, SE)
    assert found.why_not == ""
    assert found.value == pytest.approx(0.82)
    x = 1.0 / KAPPA
    of_intercept = math.sqrt(float((x**2).sum()) / (4 * float(((x - x.mean()) ** 2).sum())))
    assert found.half_width == pytest.approx(1.959964 * 0.001 * of_intercept)
    falling = extrapolate(KAPPA[::-1], (0.82 - 5.0 / KAPPA)[::-1], SE)
    assert falling.value == pytest.approx(0.82)


def test_surer_levels_weigh_more() -> None:
    """A level of no weight may lie anywhere its interval allows: the others tell the line."""
    mean = 0.82 + 5.0 / KAPPA
    mean[0] += 0.5
    found = extrapolate(KAPPA, mean, np.array([1.0, 0.001, 0.001, 0.001]))
    assert found.value == pytest.approx(0.82, abs=1e-5)


def test_levels_that_go_up_and_down_have_no_limit() -> None:
    found = extrapolate(KAPPA, np.array([0.80, 0.84, 0.80, 0.84]), SE)
    assert math.isnan(found.value)
    assert found.why_not == "levels that are not monotone within their intervals"
    # Up and down by less than their intervals is as good as level.
    flat = extrapolate(KAPPA, np.array([0.820, 0.821, 0.820, 0.821]), SE)
    assert flat.value == pytest.approx(0.8208, abs=0.0005)


def test_three_levels_are_not_enough() -> None:
    found = extrapolate(KAPPA[:3], 0.82 + 5.0 / KAPPA[:3], SE[:3])
    assert found.why_not.startswith("fewer than 4 levels")
    missing = np.array([0.83, 0.825, math.nan, 0.821])
    assert extrapolate(KAPPA, missing, SE).why_not.startswith("fewer than 4 levels")


def test_a_curve_in_one_over_kappa_has_no_limit_by_a_line() -> None:
    # A logarithm goes on for ever.
    found = extrapolate(KAPPA, 0.1 * np.log(KAPPA), SE)
    assert found.why_not == "levels that are not on a line in 1/kappa"


def test_intervals_hold_a_planted_limit_as_often_as_they_say() -> None:
    noise = np.random.default_rng(2)
    held = 0
    for _ in range(400):
        found = extrapolate(KAPPA, 0.82 + 5.0 / KAPPA + noise.normal(0.0, SE), SE)
        held += not found.why_not and abs(found.value - 0.82) <= found.half_width
    # 5 % of them lie off the line by chance and have no limit; three standard errors below 0.90.
    assert held / 400 >= 0.90 - 3 * math.sqrt(0.9 * 0.1 / 400)
