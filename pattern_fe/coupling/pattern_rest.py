"""When a pattern has come to rest: a stage of settling goes on until it has."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from sandmould.engines.session import SandSession
from sandmould.pattern_fe.coupling.convergence_log import rms_m

Array = NDArray[np.float64]


class PatternRest:
    """Holds a stage while the pattern is not where the loads on it bend it.

    Sand can be at rest on a surface that still creeps to its place, or that a loop moves to and
    fro: its speed and its loads do not tell. What is left of the way, over the way, is what the
    pattern's own forces lack of the loads, which may be off by the tolerance themselves; so half of
    it is left to the way.
    """

    def __init__(self, sand: SandSession, load_tolerance: float | None) -> None:
        """Watch a pattern. ``load_tolerance``: ``rest.load_tolerance``; None holds no stage."""
        self._sand = sand
        self.share = np.inf if load_tolerance is None else 0.5 * load_tolerance
        """Part of the way that may be left."""

    def see(self, displacement_m: Array, solved_m: Array) -> None:
        """Hold the stage where a surface is too far from where its loads bend it.

        ``displacement_m``, (nv, d) float64, m: of the surface, as the sand meets it. ``solved_m``,
        (nv, d) float64, m: at rest under the mean loads of the last window.
        """
        left_m, way_m = rms_m(solved_m - displacement_m), rms_m(displacement_m)
        if left_m > self.share * way_m:
            self._sand.hold_rest(
                f"the pattern has moved by {way_m:.3g} m and is {left_m:.2g} m from where its "
                "loads bend it"
            )
