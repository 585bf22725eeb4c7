"""The method raced as ours: which point to simulate next, and the best guess so far."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from scipy.special import ndtr
from scipy.stats import qmc

from sandmould.arrays import Floats
from sandmould.statistics.config import Target
from sandmould.statistics.emulator import Emulator


def design(low: Sequence[float], high: Sequence[float], count: int, seed: int) -> Floats:
    """First points of a scrambled Sobol sequence over the bounds, (count, n) float64.

    A shorter design of the same seed is the beginning of a longer one.
    """
    sequence = qmc.Sobol(len(low), rng=np.random.default_rng(seed))
    # Powers of two alone are balanced; other counts are their beginnings.
    unit = sequence.random_base2((count - 1).bit_length())[:count]
    return np.asarray(qmc.scale(unit, low, high))


def chance(emulator: Emulator, target: Target, tolerance: float, points: Floats) -> Floats:
    """Probability that the mean of one more run at each point lies within a tolerance of a target.

    Points are (n, 2) float64, the answer (n,) float64; the tolerance is in the measure's unit.
    """
    mean, se = emulator.at(points)
    apart, sd = target.value - mean, np.hypot(se, target.sd)
    return np.asarray(ndtr((apart + tolerance) / sd) - ndtr((apart - tolerance) / sd))


def next_point(
    emulator: Emulator, target: Target, tolerance: float, candidates: Floats, tried: Floats
) -> Floats:
    """Candidate of the greatest ``chance`` that was not tried, (2,) float64.

    One or two replicates would give the emulator a poor estimate of the noise of a run.
    """
    is_tried = (candidates[:, None] == tried[None]).all(axis=-1).any(axis=1)
    left = candidates[~is_tried]
    return np.asarray(left[int(chance(emulator, target, tolerance, left).argmax())])


def best_guess(emulator: Emulator, target: Target, candidates: Floats) -> Floats:
    """Candidate with the smallest expected squared miss of the target, (2,) float64."""
    mean, se = emulator.at(candidates)
    return np.asarray(candidates[int(((mean - target.value) ** 2 + se**2).argmin())])
