"""Which runs the next round computes."""

from __future__ import annotations

import math
from collections.abc import Collection, Sequence
from functools import partial

import numpy as np
import pandas as pd

from sandmould.runs.columns import REPLICATE
from sandmould.statistics.optimum import Optimum

NEAR = 0.03
"""Share of the range within which a new point would tell no more than a replicate."""
DIGITS = 3


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
