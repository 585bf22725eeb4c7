"""Choosing the next point to simulate, on surfaces that are known."""

from __future__ import annotations

from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest
from scipy.stats import norm

from benchmarks.calibration.refine import best_guess, chance, design, next_point
from sandmould.statistics.config import Target
from sandmould.statistics.emulator import fit_emulator

LOW, HIGH = (0.1, 0.0), (0.8, 0.3)
TARGET = Target(value=25.0, sd=0.3)


def angle_deg(points: np.ndarray) -> np.ndarray:
    return 12.0 + 14.0 * np.tanh(2.0 * points[:, 0]) + 40.0 * points[:, 1]


def knowing(mean: list[float], se: list[float]) -> Any:
    """An emulator whose mean and standard error at three points are given."""
    return SimpleNamespace(at=lambda points: (np.array(mean)[: len(points)], np.array(se)))


def test_a_design_fills_the_bounds_and_a_shorter_one_is_its_beginning() -> None:
    long = design(LOW, HIGH, 64, seed=3)
    assert long.shape == (64, 2)
    assert (long >= LOW).all()
    assert (long <= HIGH).all()
    # Balanced: as many in each half.
    assert ((long[:, 0] < 0.45).sum(), (long[:, 1] < 0.15).sum()) == (32, 32)
    for count in (1, 6, 7):
        np.testing.assert_array_equal(design(LOW, HIGH, count, seed=3), long[:count])
    assert not np.array_equal(design(LOW, HIGH, 6, seed=4), long[:6])


def test_chances_are_those_of_a_normal() -> None:
    points = np.zeros((3, 2))
    found = chance(knowing([25.0, 26.0, 25.0], [0.4, 0.4, 4.0]), TARGET, 0.5, points)
    assert found[0] == pytest.approx(2 * norm.cdf(1.0) - 1)  # sd 0.5 of 0.3 and 0.4
    assert found[1] == pytest.approx(norm.cdf(-1.0) - norm.cdf(-3.0))
    # On target by luck alone is worth less than near it by knowledge.
    assert found[0] > found[1] > found[2] > 0.0


def test_the_point_of_the_greatest_chance_that_was_not_tried_is_next() -> None:
    emulator = fit_emulator("angle", (start := design(LOW, HIGH, 12, 1)), angle_deg(start))
    candidates = np.array([[0.15, 0.02], [0.53, 0.05], [0.45, 0.06], [0.7, 0.28]])
    misses = np.abs(angle_deg(candidates) - TARGET.value)
    chosen = next_point(emulator, TARGET, 0.5, candidates, start)
    assert misses.argmin() == 1
    assert chosen.tolist() == candidates[1].tolist()
    assert best_guess(emulator, TARGET, candidates).tolist() == candidates[1].tolist()
    again = next_point(emulator, TARGET, 0.5, candidates, np.vstack([start, chosen]))
    assert again.tolist() == candidates[2].tolist()


def test_a_guess_is_rather_known_than_on_target() -> None:
    candidates = np.array([[0.1, 0.0], [0.2, 0.0], [0.3, 0.0]])
    guess = best_guess(knowing([25.0, 25.4, 27.0], [3.0, 0.1, 0.1]), TARGET, candidates)
    assert guess.tolist() == [0.2, 0.0]


@pytest.mark.parametrize("seed", [1, 2, 3])
def test_a_ridge_is_found_in_few_noisy_runs(seed: int) -> None:
    rng, candidates = np.random.default_rng(seed), design(LOW, HIGH, 512, seed)
    points = candidates[:6]
    values = angle_deg(points) + rng.normal(0.0, 0.3, len(points))
    for _ in range(8):
        emulator = fit_emulator("angle", points, values)
        point = next_point(emulator, TARGET, 0.5, candidates, points)
        points = np.vstack([points, point])
        values = np.append(values, angle_deg(point[None]) + rng.normal(0.0, 0.3))
    guess = best_guess(fit_emulator("angle", points, values), TARGET, candidates)
    assert angle_deg(guess[None])[0] == pytest.approx(TARGET.value, abs=0.5)
    # After the start it stays near the ridge.
    assert np.abs(angle_deg(points[8:]) - TARGET.value).max() < 2.0
