"""How a measure goes over the time of vibration: its last quarter, and when it reaches a level."""

from __future__ import annotations

import math
from collections.abc import Iterable
from dataclasses import dataclass

import numpy as np
import pandas as pd
import scipy
from numpy.typing import ArrayLike, NDArray

from sandmould.runs.columns import RUN, STAGE, VIBRATION_TIME_S, during_vibration

STILL = 0.02
"""Share by which a measure may still change in the last quarter of a vibration."""
SURE = 0.9
"""One-sided confidence that a mean change is one, where runs do not move one way (argued)."""
_LIKE = 0.05
"""Share of a period by which like moments may differ."""


@dataclass(frozen=True)
class Passage:
    """A measure during the vibration, as the mean of some runs."""

    first: float
    late: float
    """At three quarters of the time."""
    last: float
    lasts_s: float
    swing: float = 0.0
    """What it goes back and forth by, the rest after the vibration among it."""
    chance: float = 0.0
    """What the mean change of the last quarter may be off by; 0 where all runs move one way."""

    @property
    def change(self) -> float:
        """Share by which it changed in the last quarter; 0 where it is still, or not known."""
        return self._moved if abs(self._moved) >= STILL and not self.is_unclear else 0.0

    @property
    def is_unclear(self) -> bool:
        """Whether it moves at the end, by no more than it swings or chance makes of it."""
        moved = abs(self.last - self.late)
        swings = moved - self.swing < STILL * abs(self.late)
        return abs(self._moved) >= STILL and (swings or moved <= self.chance)

    @property
    def _moved(self) -> float:
        return self.last / self.late - 1.0 if self.late else 0.0


def passage_of(
    curves: pd.DataFrame, runs: Iterable[str], measure: str, period_s: float = 0.0
) -> Passage | None:
    """A measure of some runs over their vibration; None where no run tells.

    ``period_s``: of a measure that swings with the box. Records at unlike moments of it do not
    tell whether the measure still changes.
    """
    runs = list(runs)
    passages, at_like_moments = [], True
    for name, run in _shaken(curves, runs, measure).groupby(RUN):
        time_s, value = (run[c].to_numpy(dtype=np.float64) for c in (VIBRATION_TIME_S, measure))
        if len(time_s) > 3 and np.isfinite(value).all():
            late = float(np.interp(0.75 * time_s[-1], time_s, value))
            own = curves[(curves[RUN] == name) & (curves[VIBRATION_TIME_S] >= 0)][measure].dropna()
            swing = _swing(own.to_numpy(dtype=np.float64))
            late_s = time_s[time_s >= 0.7 * time_s[-1]]
            at_like_moments &= not period_s or _are_whole((late_s - time_s[-1]) / period_s)
            passages.append((float(value[0]), late, float(value[-1]), float(time_s[-1]), swing))
    if not passages:
        return None
    moved = np.array([last - late for _, late, last, *_ in passages])
    chance = 0.0
    if moved.min() * moved.max() < 0.0:
        error = float(moved.std(ddof=1)) / math.sqrt(len(moved))
        chance = float(scipy.special.stdtrit(len(moved) - 1, SURE)) * error
    chance = chance if at_like_moments else math.inf
    first, late, end, lasts_s, swing = np.mean(passages, axis=0).tolist()
    return Passage(first, late, end, lasts_s, swing, chance)


def _are_whole(periods: NDArray[np.float64]) -> bool:
    return bool((np.abs(periods - np.rint(periods)) < _LIKE).all())


def _swing(course: NDArray[np.float64]) -> float:
    """The lesser of the largest fall and the largest rise of a course: 0 of one that only rises."""
    fall = (np.maximum.accumulate(course) - course).max()
    rise = (course - np.minimum.accumulate(course)).max()
    return float(min(fall, rise))


def reached_s(curves: pd.DataFrame, runs: Iterable[str], measure: str, level: float) -> float:
    """Time of vibration from which the mean of runs stays at a level or above; NaN where not.

    That of the first record where the mean is there from then on and at the end: dips between are
    not counted.
    """
    shaken = _shaken(curves, runs, measure)
    of_runs = [(run[VIBRATION_TIME_S], run[measure]) for _, run in shaken.groupby(RUN)]
    if not of_runs:
        return math.nan
    time_s = np.unique(np.concatenate([times for times, _ in of_runs]))
    mean = np.mean([np.interp(time_s, *curve) for curve in of_runs], axis=0)
    below = np.flatnonzero(mean < level)
    if mean[0] >= level <= mean[-1]:
        return float(time_s[0])
    return first_reach_s(time_s[below[-1] :], mean[below[-1] :], level)


def _shaken(curves: pd.DataFrame, runs: Iterable[str], measure: str) -> pd.DataFrame:
    if measure not in curves or STAGE not in curves:
        return pd.DataFrame(columns=[RUN])
    return during_vibration(curves[curves[RUN].isin(list(runs))])


def first_reach_s(time_s: ArrayLike, value: ArrayLike, level: float) -> float:
    """Time at which a quantity first reaches a level, between two records by straight line.

    Parameters
    ----------
    time_s, value : (n,) float64
        In order of time.

    Returns
    -------
    float, s
        NaN where it never does.
    """
    time_s, value = np.asarray(time_s, dtype=np.float64), np.asarray(value, dtype=np.float64)
    above = np.flatnonzero(value >= level)
    if not len(above):
        return math.nan
    after = int(above[0])
    if after == 0:
        return float(time_s[0])
    before = after - 1
    share = (level - value[before]) / (value[after] - value[before])
    return float(time_s[before] + share * (time_s[after] - time_s[before]))
