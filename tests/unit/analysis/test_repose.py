"""Angles of slopes whose angle is known."""

from __future__ import annotations

import math

import numpy as np
import pytest

from sandmould.analysis.repose import (
    Surface,
    fit_flank,
    free_surface,
    heap_slope,
    lying,
    profiles,
    residue_slope,
    walls_touched,
)


def lattice(dimension: int, radius_m: float, size_m: tuple[float, ...]) -> np.ndarray:
    """Centres of grains on a square grid that fills a box."""
    axes = [np.arange(radius_m, size, 2 * radius_m) for size in size_m]
    return np.stack(np.meshgrid(*axes, indexing="ij"), axis=-1).reshape(-1, dimension)


def pile(dimension: int, angle_deg: float, radius_m: float = 0.5e-3) -> np.ndarray:
    """Centres of the grains of a wedge or cone of an angle in the middle of a floor."""
    size = (0.2,) * (dimension - 1) + (0.06,)
    grid = lattice(dimension, radius_m, size)
    distance = np.linalg.norm(grid[:, :-1] - 0.1, axis=1)
    return grid[grid[:, -1] <= 0.05 - distance * math.tan(math.radians(angle_deg))]


@pytest.mark.parametrize("angle_deg", [30.0, 38.0])
@pytest.mark.parametrize("dimension", [2, 3])
def test_a_pile_of_known_angle_is_measured(dimension: int, angle_deg: float) -> None:
    radius_m = {2: 0.5e-3, 3: 1e-3}[dimension]
    position = pile(dimension, angle_deg, radius_m)
    axes = dimension - 1
    radius = np.full(len(position), radius_m)
    surface = free_surface(position, radius, np.zeros(axes), np.full(axes, 0.2), 0.0)
    slope = heap_slope(surface, 4 * radius_m, np.full(axes, 0.1))
    assert len(slope.flanks) == {2: 2, 3: 4}[dimension]
    # Steps of a grain over a slope of 30 or 60 of them; in 3D the median of a ring's few terraces.
    assert slope.angle_deg == pytest.approx(angle_deg, abs={2: 0.4, 3: 0.5}[dimension])
    assert 0.0 < slope.se_deg < 0.6
    assert walls_touched(surface, np.zeros(axes), np.full(axes, 0.2), 3 * radius_m) == []


def test_a_splashed_apron_does_not_flatten_the_slope_above_it() -> None:
    steep, grid = pile(2, 30.0), lattice(2, 0.5e-3, (0.2, 0.016))
    # 15 mm high at the slope's foot, a third of what is left of the height, and half as steep.
    apron = grid[grid[:, 1] <= 0.015 - (np.abs(grid[:, 0] - 0.1) - 0.0606) * math.tan(0.27)]
    both = np.unique(np.vstack([steep, apron]).round(7), axis=0)
    surface = free_surface(both, np.full(len(both), 0.5e-3), np.zeros(1), np.full(1, 0.2), 0.0)
    assert heap_slope(surface, 2e-3, np.array([0.1])).angle_deg == pytest.approx(30.0, abs=0.6)


def test_a_flat_top_and_stray_grains_turn_no_flank() -> None:
    whole = pile(2, 30.0)
    strays = np.array([[0.005, 0.5e-3], [0.195, 0.5e-3], [0.19, 1.5e-3]])
    worn = np.vstack([whole[whole[:, 1] < 0.042], strays])
    radius = np.full(len(worn), 0.5e-3)
    surface = free_surface(worn, radius, np.zeros(1), np.full(1, 0.2), 0.0)
    assert heap_slope(surface, 2e-3, np.array([0.1])).angle_deg == pytest.approx(30.0, abs=0.5)


@pytest.mark.parametrize("dimension", [2, 3])
def test_what_stays_round_an_outlet_is_measured_from_the_hopper_floor(dimension: int) -> None:
    grid = lattice(dimension, 1e-3, (0.2,) * (dimension - 1) + (0.08,))
    distance = np.linalg.norm(grid[:, :-1] - 0.1, axis=1)
    held = grid[grid[:, -1] <= (distance - 0.02) * math.tan(math.radians(35.0))]
    held[:, -1] += 0.25
    below = np.array([[0.1] * (dimension - 1) + [0.01]])
    position = np.vstack([held, below])
    radius = np.full(len(position), 1e-3)
    axes = dimension - 1
    surface = free_surface(position, radius, np.zeros(axes), np.full(axes, 0.2), 0.25)
    slope = residue_slope(surface, 4e-3, np.full(axes, 0.1))
    assert slope.angle_deg == pytest.approx(35.0, abs=0.7)


@pytest.mark.parametrize("dimension", [2, 3])
def test_grains_that_fall_do_not_lie_on_the_heap(dimension: int) -> None:
    heap = lattice(dimension, 1e-3, (0.01,) * dimension)
    over = np.full(dimension, 5e-3)
    # Two that fall touching each other, one a tenth of a radius above the heap, one on the floor.
    falling = over + np.zeros((3, dimension))
    falling[:, -1] = [0.05, 0.052, 0.0111]
    beside = np.full((1, dimension), 0.05)
    beside[:, -1] = 1e-3
    position = np.vstack([falling, heap, beside])
    held = lying(position, np.full(len(position), 1e-3), 0.0)
    assert not held[:3].any()
    assert held[3:].all()
    assert len(lying(np.zeros((0, dimension)), np.zeros(0), 0.0)) == 0


def test_the_surface_is_the_highest_place_of_each_cell() -> None:
    position, radius = np.array([[0.01, 0.002], [0.013, 0.004], [0.013, -0.004]]), np.full(3, 2e-3)
    surface = free_surface(position, radius, np.zeros(1), np.array([0.02]), 0.0)
    x = surface.point_m[:, 0]
    assert len(x) == 5
    fine = np.linspace(0.0, 0.02, 200_001)
    cap = np.maximum(4e-6 - (fine[:, None] - position[:2, 0]) ** 2, 0.0)
    tops = np.where(cap > 0.0, position[:2, 1] + np.sqrt(cap), 0.0).max(axis=1)
    expected = [tops[np.abs(fine - middle) <= 2e-3].max() for middle in x]
    np.testing.assert_allclose(surface.height_m, expected, atol=1e-5)
    assert (surface.height_m == 0.0).any()


def test_profiles_are_means_over_columns_outwards() -> None:
    surface = Surface(np.array([[0.5], [1.5], [2.5], [3.5]]), np.array([1.0, 2.0, 3.0, 5.0]))
    found = profiles(surface, 2.0, np.array([2.0]))
    np.testing.assert_allclose(found["left"], [[1.0], [1.5]])
    np.testing.assert_allclose(found["right"], [[1.0], [4.0]])


def test_a_heap_at_a_wall_is_named() -> None:
    position = pile(2, 20.0)
    radius = np.full(len(position), 0.5e-3)
    low, high = np.zeros(1), np.array([0.2])
    surface = free_surface(position, radius, low, high, 0.0)
    assert walls_touched(surface, low, high, 1.5e-3) == ["left", "right"]


def test_too_small_a_slope_gives_no_angle() -> None:
    flank = fit_flank("left", np.arange(4.0), np.arange(4.0))
    assert math.isnan(flank.angle_deg)
    assert math.isnan(flank.se_deg)
    empty = free_surface(np.zeros((0, 2)), np.zeros(0), np.zeros(1), np.ones(1), 0.0)
    assert math.isnan(heap_slope(empty, 0.1, np.array([0.5])).angle_deg)


def test_the_error_of_a_slope_covers_correlated_noise() -> None:
    rng = np.random.default_rng(5)
    x = np.linspace(0.0, 1.0, 60)
    error, claimed = [], []
    for _ in range(300):
        noise = np.zeros(60)
        for i in range(1, 60):
            noise[i] = 0.6 * noise[i - 1] + rng.normal(0.0, 0.02)
        flank = fit_flank("left", x, 0.5 * x + noise)
        error.append(flank.angle_deg - math.degrees(math.atan(0.5)))
        claimed.append(flank.se_deg)
    # 300 draws know a spread to 4 %; the correlation of 35 points is known far worse.
    assert np.mean(claimed) == pytest.approx(np.std(error), rel=0.3)
