"""What each of several swept keys does, on average over the others."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from sandmould.statistics.mean_tests import MeanTest
from sandmould.statistics.settings import Comparison
from sandmould.statistics.verdict import Verdict

_ROUND_OFF = 1e-12
TREND = 0.25
"""Chance of a trend of its size, from which on it is none to go by: to try a value costs little
(argued)."""


@dataclass(frozen=True)
class MainEffect:
    """The two levels of a key that are farthest apart, each averaged over all other keys."""

    key: str
    high: Any
    """Level with the highest mean."""
    low: Any
    apart: Comparison
    """High minus low, or over it, by the scatter that all settings share if they do; its interval
    holds for all pairs of the key's levels together."""


def main_effects(verdict: Verdict, keys: Sequence[str]) -> tuple[MainEffect, ...]:
    """Find what each key does; nothing without a full grid of several keys, run more than once.

    ``keys``: those that the settings of the verdict differ in.
    """
    spread, settings = verdict.spread, verdict.settings
    levels = {key: list(dict.fromkeys(s.values[key] for s in settings)) for key in keys}
    is_grid = math.prod(map(len, levels.values())) == len(settings)
    is_run = all(s.n and s.planned > 1 for s in settings)
    if len(keys) < 2 or not (spread and is_grid and is_run and spread.contrasts.df > 0):
        return ()
    contrasts, found = spread.contrasts, []
    for key, values in levels.items():
        at = np.array([[s.values[key] == value for s in settings] for value in values])
        weights = at / at.sum(axis=1, keepdims=True)
        means = weights @ contrasts.means
        high, low = int(means.argmax()), int(means.argmin())
        difference, error, df = spread.weigh(weights[high] - weights[low])
        if error > _ROUND_OFF * float(np.abs(means).max()):
            test = MeanTest(difference, error, df, len(values))
            apart = Comparison.of(str(values[low]), difference, test, verdict.by_factor)
            found.append(MainEffect(key, values[high], values[low], apart))
    return tuple(found)


def has_trend(verdict: Verdict, key: str) -> bool:
    """Whether a measure goes one way with a key of numbers, averaged over the other keys.

    The line through the means over the rank of the key's values is tested by the scatter that all
    settings share. True where one run each tells nothing of chance.
    """
    spread, used = verdict.spread, [s for s in verdict.settings if s.n]
    if spread is None or spread.contrasts.df <= 0:
        return True
    levels = sorted({s.values[key] for s in used})
    rank = np.array([levels.index(s.values[key]) for s in used], dtype=np.float64)
    difference, error, df = spread.weigh(rank - rank.mean())
    if not error > _ROUND_OFF * float(np.abs(spread.contrasts.means).max()):
        return True
    return MeanTest(difference, error, df).pvalue < TREND
