"""Kinds of grain and what two of them make of each other."""

from __future__ import annotations

import math

import numpy as np
import pytest

from sandmould.dem.contact_law import Law
from sandmould.dem.grains import MOST_KINDS, Grains
from sandmould.dem.moving_state import pair_up

LAW = Law(1e4, 8e3, 0.4, 0.2, 0.1, 5e3, True, False)


def _grains(radius_m: np.ndarray, mass_kg: np.ndarray) -> Grains:
    n = len(radius_m)
    plane, line = np.zeros((n, 2)), np.zeros((n, 1))
    return Grains.of(np.arange(n), plane, plane, line, radius_m, mass_kg, mass_kg * radius_m**2)


def test_two_kinds_have_the_damping_and_rolling_of_their_sizes() -> None:
    radius_m = np.array([2e-3, 1e-3, 2e-3, 1e-3])
    mass_kg = np.array([8e-3, 1e-3, 8e-3, 2e-3])
    grains = _grains(radius_m, mass_kg)
    coefficients = pair_up(grains, LAW)
    assert grains.kind.tolist() == [0, 1, 0, 2]
    for i in range(4):
        for j in range(4):
            m = mass_kg[i] * mass_kg[j] / (mass_kg[i] + mass_kg[j])
            r = radius_m[i] * radius_m[j] / (radius_m[i] + radius_m[j])
            exact = (0.4 * math.sqrt(m * 1e4), 5e3 * r**2, 0.1 * min(radius_m[i], radius_m[j]))
            found = coefficients[grains.kind[i], grains.kind[j]]
            np.testing.assert_allclose(found, exact, rtol=1e-14)  # the same few operations


def test_more_kinds_than_a_byte_tells_apart_are_refused() -> None:
    radius_m = np.linspace(1e-3, 2e-3, MOST_KINDS + 1)
    with pytest.raises(ValueError, match="size classes"):
        _grains(radius_m, np.ones_like(radius_m))
    some = _grains(radius_m[1:], np.ones(MOST_KINDS))
    assert len(np.unique(some.kind)) == MOST_KINDS
    one = _grains(radius_m[:1], np.ones(1))
    with pytest.raises(ValueError, match="size classes"):
        some.joined(one)


def test_joined_grains_keep_their_sizes() -> None:
    some = _grains(np.array([2e-3, 1e-3, 2e-3]), np.array([8e-3, 1e-3, 8e-3]))
    more = _grains(np.array([3e-3, 1e-3]), np.array([27e-3, 1e-3]))
    both = some.joined(more)
    assert both.radius.tolist() == [2e-3, 1e-3, 2e-3, 3e-3, 1e-3]
    assert both.mass.tolist() == [8e-3, 1e-3, 8e-3, 27e-3, 1e-3]
    assert both.inertia.tolist() == [*some.inertia, *more.inertia]
    assert len(both.radius_of) == 3
