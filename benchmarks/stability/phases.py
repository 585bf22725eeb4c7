"""Head-on impacts by central differences whose first touch falls anywhere within a time step.

One contact alone, eqs. (15)-(21), total force clipped, in units of its mass, its spring and the
speed before: no engine, only the scheme that all engines share.
"""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from benchmarks.frame.impact import Impacts, exact

Array = NDArray[np.float64]

PHASES = 256
"""Places of the first touch within a step, evenly."""
DAMPING_RATIOS = (0.2, 0.5, 0.7, 0.95, 1.0)
STEPS = (0.05, 0.1, 0.2, 0.4)
"""Time steps over sqrt(m/k)."""
_LONGEST = 10.0
"""Over sqrt(m/k), three times the longest contact, that of no damping."""


def impacts(damping_ratio: float, step: float, corrected: bool) -> Impacts:
    """Compute an impact for each place of the first touch.

    Parameters
    ----------
    damping_ratio : float
        zeta, eq. (19).
    step : float
        Over sqrt(m/k).
    corrected : bool
        Whether the dashpot is c' = c/(1 + c dt/(4 m)).
    """
    c = 2.0 * damping_ratio
    c /= 1.0 + 0.25 * c * step if corrected else 1.0
    # One step before the first overlap; the touch itself is at time 0.
    time = overlap = step * ((np.arange(PHASES) + 0.5) / PHASES - 1.0)
    speed, peak = np.ones(PHASES), np.zeros(PHASES)
    before, ended, touched = np.zeros(PHASES), np.full(PHASES, np.nan), np.zeros(PHASES, bool)
    for _ in range(math.ceil(_LONGEST / step)):
        force = overlap + c * speed
        ends = touched & np.isnan(ended) & (force <= 0.0)
        ended[ends] = (time - step * force / (force - before))[ends]
        touched |= overlap > 0.0
        speed = speed - step * np.where(overlap > 0.0, np.maximum(force, 0.0), 0.0)
        overlap, time, before = overlap + step * speed, time + step, force
        peak = np.maximum(peak, overlap)
    return Impacts(-speed, peak, ended)


def errors() -> list[dict[str, float | list[tuple[float, float]]]]:
    """Give the mean and the standard deviation of relative errors, a row a ratio and step.

    Returns
    -------
    list of dict
        ``damping_ratio``, ``step`` and ``errors``: of restitution, peak overlap and contact time,
        each plain and then corrected.
    """
    rows: list[dict[str, float | list[tuple[float, float]]]] = []
    for ratio in DAMPING_RATIOS:
        for step in STEPS:
            found = [impacts(ratio, step, corrected) for corrected in (False, True)]
            off = [
                each / value - 1.0
                for value, *both in zip(exact(ratio), *found, strict=True)
                for each in both
            ]
            spread = [(float(x.mean()), float(x.std())) for x in off]
            rows.append({"damping_ratio": ratio, "step": step, "errors": spread})
    return rows
