"""The gain of the staggered loop, measured: how stiff the sand is beside the pattern."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from sandmould.engines.session import SandSession
from sandmould.pattern_fe.coupling.body import ElasticBody
from sandmould.pattern_fe.coupling.convergence_log import rms_m

Array = NDArray[np.float64]
MOVED_M = 1e-6
"""Perturbation, root of the mean square over the vertices: grains overlap a surface by some hundred
times as much."""


@dataclass(frozen=True)
class Gain:
    """Change of the pattern's solution, taken negative, over that of the interface displacement."""

    gain: float

    @property
    def limit(self) -> float:
        """Fixed factor below which the loop holds, 2 / (1 + g).

        With a spring a and a dashpot b of the sand, as shares of the pattern's stiffness and the
        dashpot over the window, g = a + 2 b; the true limit is the smaller of 2 / (1 + 2 b) and
        2 / (a - 2 b), where that is positive. Neither is below 2 / (1 + g).
        """
        return 2.0 / (1.0 + max(0.0, self.gain))


def measure_gain(
    session: SandSession, body: ElasticBody, surface: str, displacement_m: Array, window_s: float
) -> Gain | None:
    """Compute a window twice, once led a little farther along the solution; the session stays.

    None where no sand presses on the pattern. ``session``: of an engine that repeats windows.
    ``displacement_m``, (nv, d) float64, m: displacement at the interface that the window leads to.

    Raises
    ------
    RefusedError
        On an engine that does not.
    """
    checkpoint = session.save_checkpoint()

    def solved(target_m: Array) -> Array | None:
        session.move_surface(surface, body.vertices_m + target_m, window_s)
        session.advance(window_s)
        load = session.vertex_loads(surface)
        session.restore_checkpoint(checkpoint)
        return None if load is None else body.solve(load).displacement_m

    plain = solved(displacement_m)
    if plain is None or not plain.any():
        return None
    way = plain * (MOVED_M / rms_m(plain))
    led = solved(displacement_m + way)
    assert led is not None
    # the surface moves evenly: in the mean over the window the sand sees half of the way
    return Gain(-float(np.vdot(led - plain, way) / (0.5 * np.vdot(way, way))))
