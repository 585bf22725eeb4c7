"""Where a casting freezes last, and its hot spots, from the time at which each element froze."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.spatial import cKDTree

Array = NDArray[np.float64]


@dataclass(frozen=True)
class Freezing:
    """How a casting froze."""

    solidification_time_s: float
    """NaN where some of it is still liquid."""
    last_point_m: Array
    """(d,) float64, m: the last element to freeze; NaN where some are liquid."""
    hot_spots_m: Array
    """(k, d) float64, m, the latest first."""
    hot_spot_s: Array
    """(k,) float64, s: when each froze."""


def freezing(position_m: Array, frozen_s: Array, reach_m: float) -> Freezing:
    """Find the last point to freeze and all that freeze later than what lies round them.

    Elements that are still liquid count as the latest of all.

    Parameters
    ----------
    position_m : (n, d) float64, m
        Of the casting's elements.
    frozen_s : (n,) float64, s
        NaN where still liquid.
    reach_m : float, m
        A hot spot freezes later than all elements within this distance.

    Raises
    ------
    ValueError
        When there is no element or the reach is not above 0.
    """
    if not len(frozen_s) or not reach_m > 0.0:
        raise ValueError(
            f"{len(frozen_s)} elements and reach_m = {reach_m}; at least one element and a reach "
            "above 0 are needed"
        )
    time_s = np.where(np.isnan(frozen_s), np.inf, frozen_s)
    latest_first = np.argsort(-time_s, kind="stable")
    rank = np.empty(len(time_s), dtype=np.int64)
    rank[latest_first] = np.arange(len(time_s))
    # of elements that freeze together, as mirror images do, the first stands for all
    tree = cKDTree(position_m)
    _, nearest = tree.query(position_m, k=2 * position_m.shape[1] + 1, distance_upper_bound=reach_m)
    before_these = np.append(rank, len(rank))[nearest].min(axis=1) >= rank
    latest = latest_first[before_these[latest_first]]  # few are left to be held against all near
    near = tree.query_ball_point(position_m[latest], reach_m)
    spots = [i for i, others in zip(latest, near, strict=True) if rank[others].min() == rank[i]]
    ends = float(time_s.max())
    liquid = math.isinf(ends)
    return Freezing(
        math.nan if liquid else ends,
        np.full(position_m.shape[1], math.nan) if liquid else position_m[latest_first[0]],
        position_m[spots],
        time_s[spots],
    )
