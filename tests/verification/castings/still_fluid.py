"""The paper's still fluid, run and judged: figures 3 to 7."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from sandmould.arrays import Floats
from sandmould.casting.mps.flow import Flow, RunningCost
from sandmould.casting.mps.particles import Kernel, weight_slope
from sandmould.casting.mps.probes import History, Watch
from sandmould.casting.mps.scene import COLUMNS, ROWS, SPACING_M, open_tank
from sandmould.casting.mps.scheme import LiquidMetal, Scheme
from sandmould.casting.mps.stability_measures import (
    COUNTS,
    SHARES,
    STEPS_S,
    StabilityRating,
    rate_stability,
    still_hops,
)

DEPTHS_M = (0.03, 0.05, 0.07)
"""Below the surface, at half the width: where the paper measures."""
DURATION_S = 2.0


@dataclass(frozen=True)
class Still:
    """A run of the still fluid."""

    scheme: Scheme
    verdict: StabilityRating
    stopped: str
    """Why a guard stopped it, or nothing."""
    history: History
    cost: RunningCost

    def mean_pa(self) -> Floats:
        """Mean pressure at the depths, (3,) float64, Pa; NaN where a run failed at once."""
        return self._over_time(self.history.mean_pa)

    def deviation_pa(self, window_s: float = 0.0) -> Floats:
        """Standard deviation at the depths, (3,) float64, Pa, as ``History.deviation_pa``."""
        return self._over_time(lambda: self.history.deviation_pa(window_s))

    def _over_time(self, measure: Callable[[], Floats]) -> Floats:
        if not len(self.history.time_s):
            return np.full(len(DEPTHS_M), np.nan)
        return measure()


def compression_gain(kernel: Kernel) -> float:
    """Relative change of the number density over that of the volume, inside a lattice.

    Eq. (2) leaves out the particle itself, so that n/n0 changes faster than the volume: with
    c_k = 2.1 by 1.7 times in the plane. One relaxation of the source (6) changes the density by
    c_poi times this: c_poi = 1 overshoots by 70 %, 1/1.7 = 0.6 would be exact in long waves.
    """
    reach = math.ceil(kernel.reach_m / kernel.spacing_m)
    axes = [np.arange(-reach, reach + 1)] * kernel.dimension
    site = np.stack(np.meshgrid(*axes), axis=-1).reshape(-1, kernel.dimension)
    far_m = kernel.spacing_m * np.sqrt((site**2).sum(axis=1))
    total = sum(weight_slope(kernel, float(r)) * float(r) for r in far_m)
    return -total / (kernel.dimension * kernel.lattice_density)


def ideal_pa(metal: LiquidMetal | None = None) -> Floats:
    """Hydrostatic pressure at the depths, (3,) float64, Pa: 735, 1225 and 1715."""
    metal = metal or LiquidMetal()
    g = float(np.linalg.norm(metal.gravity_m_s2))
    return metal.density_kg_m3 * g * np.array(DEPTHS_M)


def probe_places() -> Floats:
    """Where the paper measures, (3, 3) float64, m."""
    height_m = ROWS * SPACING_M - np.array(DEPTHS_M)
    half = np.full(3, 0.5 * COLUMNS * SPACING_M)
    return np.stack((half, height_m, np.zeros(3)), axis=1)


def run_still(
    scheme: Scheme,
    duration_s: float = DURATION_S,
    flow: Flow | None = None,
) -> Still:
    """Run the still fluid.

    Parameters
    ----------
    scheme : Scheme
    duration_s : float, s
    flow : Flow, optional
        Other metal in the same tank.
    """
    flow = flow or open_tank(scheme)
    watch = Watch(probe_places())
    stopped = ""
    try:
        flow.advance(duration_s, watch)
    except ArithmeticError as error:
        stopped = str(error)
    history = watch.history()
    # a run that a guard stops at once has no history
    deviation_pa = math.nan if stopped else float(history.deviation_pa()[-1])
    off = math.nan if stopped else float(history.mean_pa()[-1] / ideal_pa()[-1]) - 1.0
    hops = still_hops(history, ROWS * SPACING_M, SPACING_M)
    verdict = rate_stability(stopped, hops, deviation_pa, off)
    return Still(scheme, verdict, stopped, history, flow.cost)


def table_2() -> list[Scheme]:
    """The paper's sixteen conditions."""
    return [
        Scheme(dt_s, count, share)
        for dt_s, count in zip(STEPS_S, COUNTS, strict=True)
        for share in SHARES
    ]
