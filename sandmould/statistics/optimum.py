"""Where the best setting lies between the runs, how sure that is, and which runs would tell it."""

from __future__ import annotations

import itertools
import math
from collections.abc import Collection, Sequence
from dataclasses import dataclass
from functools import cached_property, partial

import numpy as np
import pandas as pd
from numpy.typing import NDArray

from sandmould.runs.columns import REPLICATE
from sandmould.statistics.answer import SweepEnd
from sandmould.statistics.config import Better
from sandmould.statistics.emulator import Array, Emulator, fit_emulator
from sandmould.statistics.evidence import usable_values
from sandmould.statistics.mean_tests import CONFIDENCE

DRAWS = 2000
VAGUE = 0.5
"""Share of the sweep beyond which an interval names no best value (argued)."""
NEAR, DIGITS = 0.03, 3
"""Share of the range within which a new point would tell no more than a replicate, and digits of
a new one."""
LOG_RATIO = 4.0
"""A key whose values span more than this ratio is looked at by its logarithm."""
_ACROSS = {1: 241, 2: 41}
"""Points of the grid along each key; more keys get as many scattered ones as ``_SCATTERED``."""
_SCATTERED = 2048


@dataclass(frozen=True, eq=False)
class Optimum:
    """The best setting, by surfaces drawn from all that the runs leave possible."""

    keys: tuple[str, ...]
    emulator: Emulator
    """Over the keys, those of ``logs`` by their logarithm."""
    logs: NDArray[np.bool_]
    """(d,) bool."""
    sign: int
    """1 where more is better, else -1."""
    points: Array
    """(g, d) float64, in the units of the keys."""
    picks: NDArray[np.int64]
    """(DRAWS,) int64: where each drawn surface is best."""

    @cached_property
    def surface(self) -> tuple[Array, Array]:
        """Mean and standard error of the measure at ``points``, (g,) float64 each."""
        return self.at(self.points)

    @cached_property
    def best(self) -> int:
        """Which of ``points`` has the best mean."""
        return int((self.sign * self.surface[0]).argmax())

    @property
    def setting(self) -> dict[str, float]:
        """The best setting, by key."""
        return dict(zip(self.keys, self.points[self.best].tolist(), strict=True))

    @property
    def value(self) -> tuple[float, float]:
        """Mean of the measure at the best setting, and its standard error."""
        mean, se = self.surface
        return float(mean[self.best]), float(se[self.best])

    def at(self, points: Array) -> tuple[Array, Array]:
        """Mean and standard error of the measure at points in the units of the keys."""
        return self.emulator.at(_scaled(points, self.logs))

    def interval(self, key: str) -> tuple[float, float]:
        """Where the optimum lies with 95 % probability, in one key."""
        chosen = self.points[self.picks, self.keys.index(key)]
        ends = (0.5 - CONFIDENCE / 2, 0.5 + CONFIDENCE / 2)
        low, high = np.quantile(chosen, ends, method="inverted_cdf")
        return float(low), float(high)

    def reached(self, key: str) -> list[SweepEnd]:
        """The ends of the swept range that the interval reaches."""
        values = self.points[:, self.keys.index(key)]
        low, high = self.interval(key)
        lowest = [SweepEnd(key, low, False)] if low == values.min() else []
        return lowest + ([SweepEnd(key, high, True)] if high == values.max() else [])

    @property
    def is_vague(self) -> bool:
        """Whether the interval of a key is wider than ``VAGUE`` of what was swept."""
        points = _scaled(self.points, self.logs)
        ends = np.array([self.interval(key) for key in self.keys]).T
        width = np.ptp(_scaled(ends, self.logs), axis=0)
        return bool((width > VAGUE * np.ptp(points, axis=0)).any())

    def at_end(self, key: str) -> str:
        """Those ends by name: lowest, highest, both or none."""
        ends = ("highest" if end.is_highest else "lowest" for end in self.reached(key))
        return " and ".join(ends)

    def no_worse(self, key: str, margin: float) -> tuple[float, float]:
        """Values of a key around the best, the others held, that lose less than a margin."""
        place = self.keys.index(key)
        along = np.linspace(self.points[:, place].min(), self.points[:, place].max(), 401)
        line = np.tile(self.points[self.best], (len(along), 1))
        line[:, place] = along
        lost = self.value[0] - self.at(line)[0]
        good = self.sign * lost < margin
        here = int(np.abs(along - self.points[self.best, place]).argmin())
        first = here - int(np.argmin(np.append(good[here::-1], False))) + 1
        last = here + int(np.argmin(np.append(good[here:], False))) - 1
        return float(along[min(first, here)]), float(along[max(last, here)])

    def loss(self, key: str, by: float) -> float:
        """What the measure loses where a key is off the best by some of its unit.

        NaN beyond the swept range.
        """
        place = self.keys.index(key)
        point = self.points[self.best].copy()
        point[place] += by
        if not self.points[:, place].min() <= point[place] <= self.points[:, place].max():
            return float("nan")
        return self.sign * (self.value[0] - float(self.at(point[None])[0][0]))


def find_optimum(
    summary: pd.DataFrame, keys: Sequence[str], measure: str, better: Better, seed: int = 0
) -> Optimum:
    """Fit a surface through the runs and see where it may be best.

    Raises
    ------
    TooFewRunsError
    """
    points = summary[list(keys)].to_numpy(dtype=np.float64)
    values = np.asarray(usable_values(summary, measure), dtype=np.float64)
    low, high = points.min(axis=0), points.max(axis=0)
    logs = (low > 0.0) & (high > LOG_RATIO * low)
    emulator = fit_emulator(measure, _scaled(points, logs), values)
    grid = _grid(_scaled(low, logs), _scaled(high, logs))
    # Rounding there and back must not leave the swept range.
    grid = np.clip(np.where(logs, np.exp(np.where(logs, grid, 0.0)), grid), low, high)
    sign = 1 if better == "larger" else -1
    drawn = emulator.draws(_scaled(grid, logs), DRAWS, seed)
    picks = (sign * drawn).argmax(axis=1)
    return Optimum(tuple(keys), emulator, logs, sign, grid, picks)


def _grid(low: Array, high: Array) -> Array:
    across = _ACROSS.get(len(low))
    if across is None:
        from scipy.stats import qmc  # a third of a second

        unit = qmc.Sobol(len(low), rng=np.random.default_rng(0)).random(_SCATTERED)
        scattered: Array = low + (high - low) * unit
        return scattered
    axes = [np.linspace(a, b, across) for a, b in zip(low, high, strict=True)]
    return np.array(list(itertools.product(*axes)))


def _scaled(points: Array, logs: NDArray[np.bool_]) -> Array:
    scaled: Array = np.where(logs, np.log(np.where(logs, points, 1.0)), points)
    return scaled


def propose(
    optimum: Optimum, summary: pd.DataFrame, runs: int, seed: int, whole: Collection[str] = ()
) -> list[tuple[dict[str, float], int]]:
    """Choose runs where the optimum may lie: each where one drawn surface is best.

    A point near one that has runs becomes a further replicate of that: so replicates come where
    the spread hides the best, and new points where the surface is not known.

    ``whole``: keys that take whole numbers only.
    """
    keys = optimum.keys
    rng = np.random.default_rng([seed, runs])
    count: dict[tuple[float, ...], int] = {}
    for *values_of_run, replicate in (
        summary[[*keys, REPLICATE]].to_numpy(dtype=np.float64).tolist()
    ):
        place = tuple(values_of_run)
        count[place] = max(count.get(place, 0), int(replicate))
    chosen = []
    for pick in rng.choice(optimum.picks, size=runs, replace=False):
        values = _rounded(keys, optimum.points[int(pick)].tolist(), optimum, whole)
        nearest = min(count, key=partial(_apart, optimum, second=values))
        if _apart(optimum, nearest, values) <= NEAR:
            values = nearest
        count[values] = count.get(values, 0) + 1
        chosen.append((_point(keys, values, whole), count[values]))
    return chosen


def _apart(optimum: Optimum, first: Sequence[float], second: Sequence[float]) -> float:
    """Largest distance along a key, over its range; logarithms where the optimum takes them."""
    ends = optimum.points.min(axis=0), optimum.points.max(axis=0)
    far = 0.0
    for a, b, low, high, log in zip(first, second, *ends, optimum.logs, strict=True):
        share = math.log(b / a) / math.log(high / low) if log else (b - a) / (high - low)
        far = max(far, abs(share))
    return far


def _rounded(
    keys: Sequence[str], values: Sequence[float], optimum: Optimum, whole: Collection[str]
) -> tuple[float, ...]:
    """Values of few digits, inside what was swept."""
    low, high = optimum.points.min(axis=0), optimum.points.max(axis=0)
    return tuple(
        float(np.clip(round(v) if key in whole else float(f"{v:.{DIGITS}g}"), a, b))
        for key, v, a, b in zip(keys, values, low, high, strict=True)
    )


def _point(
    keys: Sequence[str], values: Sequence[float], whole: Collection[str]
) -> dict[str, float]:
    return {key: round(v) if key in whole else v for key, v in zip(keys, values, strict=True)}
