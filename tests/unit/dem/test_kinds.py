"""Kinds of grain and what two of them make of each other."""

from __future__ import annotations

import math

import numpy as np
import pytest

from sandmould.dem.contact_law import Law
from sandmould.dem.grains import Grains
from sandmould.dem.kinds import MOST_KINDS, find_kinds

LAW = Law(1e4, 8e3, 0.4, 0.2, 0.1, 5e3, True, False)


def _grains(radius_m: np.ndarray, mass_kg: np.ndarray) -> Grains:
    n = len(radius_m)
    plane, line = np.zeros((n, 2)), np.zeros((n, 1))
    return Grains(
        np.arange(n), plane, plane, line, radius_m, mass_kg, mass_kg * radius_m**2, plane, line
    )


def test_two_kinds_have_the_damping_and_rolling_of_their_sizes() -> None:
    radius_m = np.array([2e-3, 1e-3, 2e-3, 1e-3])
    mass_kg = np.array([8e-3, 1e-3, 8e-3, 2e-3])
    kinds = find_kinds(_grains(radius_m, mass_kg), LAW)
    assert kinds.of_grain.tolist() == [0, 1, 0, 2]
    for i in range(4):
        for j in range(4):
            m = mass_kg[i] * mass_kg[j] / (mass_kg[i] + mass_kg[j])
            r = radius_m[i] * radius_m[j] / (radius_m[i] + radius_m[j])
            exact = (0.4 * math.sqrt(m * 1e4), 5e3 * r**2, 0.1 * min(radius_m[i], radius_m[j]))
            found = kinds.coefficients[kinds.of_grain[i], kinds.of_grain[j]]
            np.testing.assert_allclose(found, exact, rtol=1e-14)  # the same few operations


def test_more_kinds_than_a_byte_tells_apart_are_refused() -> None:
    radius_m = np.linspace(1e-3, 2e-3, MOST_KINDS + 1)
    with pytest.raises(ValueError, match="size classes"):
        find_kinds(_grains(radius_m, np.ones_like(radius_m)), LAW)
    some = find_kinds(_grains(radius_m[1:], np.ones(MOST_KINDS)), LAW)
    assert len(np.unique(some.of_grain)) == MOST_KINDS
