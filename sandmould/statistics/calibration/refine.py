"""Which point to simulate next, and which is the best guess so far, for one measured value."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray
from scipy.special import ndtr

from sandmould.statistics.calibration.config import Target
from sandmould.statistics.emulator import Emulator

Array = NDArray[np.float64]


def design(low: Sequence[float], high: Sequence[float], count: int, seed: int) -> Array:
    """First points of a Sobol sequence over the bounds: a start, or points to choose from.

    Parameters
    ----------
    low, high : sequence of float
    count : int
        A shorter design of the same seed is the beginning of a longer one.
    seed : int
        Of the scrambling.

    Returns
    -------
    (count, len(low)) float64
    """
    from scipy.stats import qmc  # a third of a second

    sequence = qmc.Sobol(len(low), rng=np.random.default_rng(seed))
    # Powers of two alone are balanced; other counts are their beginnings.
    unit = sequence.random_base2((count - 1).bit_length())[:count]
    points: Array = qmc.scale(unit, low, high)
    return points


def chance(emulator: Emulator, target: Target, tolerance: float, points: Array) -> Array:
    """Probability that the mean of one more run at each point lies within a tolerance of a target.

    Parameters
    ----------
    emulator : Emulator
    target : Target
    tolerance : float
        In the unit of the measure.
    points : (n, 2) float64

    Returns
    -------
    (n,) float64
    """
    mean, se = emulator.at(points)
    apart, sd = target.value - mean, np.hypot(se, target.sd)
    within: Array = ndtr((apart + tolerance) / sd) - ndtr((apart - tolerance) / sd)
    return within


def next_point(
    emulator: Emulator, target: Target, tolerance: float, candidates: Array, tried: Array
) -> Array:
    """Choose the point to simulate next: the greatest ``chance`` of all that were not tried.

    Parameters
    ----------
    emulator : Emulator
        Of the runs so far.
    target : Target
    tolerance : float
    candidates : (n, 2) float64
        Points to choose from, at least one that was not tried.
    tried : (m, 2) float64
        Left out: one or two replicates would tell the noise of a run to the emulator too badly.

    Returns
    -------
    (2,) float64
    """
    is_tried = (candidates[:, None] == tried[None]).all(axis=-1).any(axis=1)
    left = candidates[~is_tried]
    chosen: Array = left[int(chance(emulator, target, tolerance, left).argmax())]
    return chosen


def best_guess(emulator: Emulator, target: Target, candidates: Array) -> Array:
    """Point with the smallest expected squared miss of the target.

    Parameters
    ----------
    emulator : Emulator
    target : Target
    candidates : (n, 2) float64

    Returns
    -------
    (2,) float64
    """
    mean, se = emulator.at(candidates)
    guess: Array = candidates[int(((mean - target.value) ** 2 + se**2).argmin())]
    return guess
