"""Head-on impacts on an engine whose first touch falls anywhere within a time step."""

from __future__ import annotations

import math
from typing import Any

import numpy as np

from benchmarks.frame.impact import Impacts, exact
from sandmould.arrays import Floats
from tests.verification.cases.bench import OMEGA_RAD_S, RADIUS_M, Bench, law, scene

PHASES = 64
"""Impacts whose first touch falls at as many places within a step, evenly."""
SPEED_M_S = 1e-3
WHERE = ("pair", "floor")
_LONGEST = 3.6
"""Over sqrt(m/k), somewhat more than the longest contact, that of no damping."""
_CELL_M = 0.01
Row = dict[str, Any]


def trajectories(engine: str, damping_ratio: float, step: float, dashpot: str) -> dict[str, Floats]:
    """Overlaps of all impacts in every step, negative apart.

    Parameters
    ----------
    engine : str
    damping_ratio : float
    step : float
        Time step over sqrt(m/k) of the contact of two grains, and of the floor: its spring has
        twice the stiffness.
    dashpot : str

    Returns
    -------
    dict of (steps, PHASES) float64, m
        Of two grains and of grains at the floor; the first row is one step before the first touch.
    """
    n = PHASES
    pair, floor = law(2, damping_ratio), law(2, damping_ratio, normal=2.0)
    step_s = step / (math.sqrt(2.0) * OMEGA_RAD_S)
    given = scene(
        engine, 2, 3 * n, (RADIUS_M,), pair, floor, step_s,
        box={"width_m": (n + 3) * _CELL_M, "height_m": 0.2},
        contact={"dashpot": dashpot},
    )  # fmt: skip
    column = _CELL_M * (2.0 + np.arange(n))
    gap = SPEED_M_S * step_s * (1 + (np.arange(n) + 0.5) / n)
    place, velocity = np.zeros((3 * n, 2)), np.zeros((3 * n, 2))
    place[:, 0] = np.tile(column, 3)
    for k, height in enumerate((RADIUS_M + gap, np.full(n, 0.05), 0.05 + 2 * RADIUS_M + gap)):
        place[k * n : (k + 1) * n, 1] = height
    velocity[:n, 1] = velocity[2 * n :, 1] = -SPEED_M_S
    seen = []
    with Bench(given) as bench:
        bench.place(place, velocity)
        for _ in range(3 + math.ceil(_LONGEST / step)):
            height = bench.advance(step_s).position_m[:, 1]
            falls, is_hit, hits = height[:n], height[n : 2 * n], height[2 * n :]
            seen.append((2 * RADIUS_M - (hits - is_hit), RADIUS_M - falls))
    return {name: np.array([row[k] for row in seen]) for k, name in enumerate(WHERE)}


def impacts(overlap: Floats, damping_ratio: float, step: float, dashpot: str) -> Impacts:
    """What impacts come to, in units of mass, spring and speed before.

    Parameters
    ----------
    overlap : (steps, PHASES) float64
        Over v sqrt(m/k), in every step.
    damping_ratio, step, dashpot
        As for ``trajectories``; with them the force before it is clipped follows from overlaps.
    """
    c = 2.0 * damping_ratio
    c /= 1.0 + 0.25 * c * step if dashpot == "corrected" else 1.0
    force = overlap[1:] + c * np.diff(overlap, axis=0) / step
    touching = overlap[1:] > 0.0
    touched = np.maximum.accumulate(touching, axis=0)
    last = np.argmax(touched & (force <= 0.0), axis=0)
    column = np.arange(overlap.shape[1])
    before, after = force[last - 1, column], force[last, column]
    # The way before the touch, at the speed of 1.
    begins = -overlap[0]
    ends = step * (last + 1.0 - after / (after - before))
    leaves = -(overlap[-1] - overlap[-2]) / step
    return Impacts(leaves, overlap.max(axis=0), ends - begins)


def errors(engine: str, damping_ratio: float, step: float, dashpot: str) -> list[Row]:
    """Mean and standard deviation of relative errors, a row for pairs and for the floor."""
    unit_m = SPEED_M_S / (math.sqrt(2.0) * OMEGA_RAD_S)
    rows = []
    for where, overlap in trajectories(engine, damping_ratio, step, dashpot).items():
        found = impacts(overlap / unit_m, damping_ratio, step, dashpot)
        off = {
            name: value / true - 1.0
            for name, value, true in zip(Impacts._fields, found, exact(damping_ratio), strict=True)
        }
        rows.append({
            "engine": engine, "where": where, "damping_ratio": damping_ratio, "step": step,
            "dashpot": dashpot,
            **{name: [round(float(x.mean()), 5), round(float(x.std()), 5)]
               for name, x in off.items()},
        })  # fmt: skip
    return rows
