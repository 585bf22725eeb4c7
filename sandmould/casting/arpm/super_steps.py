"""Super time steps: Runge-Kutta-Legendre of second order, many cheap stages for one long step.

Meyer, Balsara and Aslam, Journal of Computational Physics 257 (2014) 594-626: s stages reach
(s^2 + s - 2)/4 explicit steps.
"""

from __future__ import annotations

import math

import numpy as np
from numba import prange, set_num_threads

from sandmould.arrays import Floats
from sandmould.casting.arpm.exchange import Exchange
from sandmould.casting.arpm.marching import (
    STEP_SHARE,
    Heat,
    HeatSystem,
    Substance,
    heat_system,
    note,
)
from sandmould.casting.arpm.material import temperature_of
from sandmould.compiled import njit

STAGES = 9
"""Odd numbers damp better (Meyer et al., section 2)."""


def stage_weights(stages: int) -> Floats:
    """Coefficients of the stages, (stages, 4) float64.

    For stage j = 1 ...: mu, nu, mu~, gamma~ of Meyer et al., eqs. (16) and (17). ``stages``: at
    least 3.

    Raises
    ------
    ValueError
        When there are fewer than 3 stages.
    """
    if stages < 3:
        raise ValueError(f"stages are {stages}; a super step needs at least 3")
    j = np.arange(stages + 1, dtype=np.float64)
    b = np.full(stages + 1, 1.0 / 3.0)
    b[2:] = (j[2:] ** 2 + j[2:] - 2.0) / (2.0 * j[2:] * (j[2:] + 1.0))
    w = 4.0 / (stages**2 + stages - 2.0)
    weights = np.zeros((stages, 4))
    weights[0, 2] = b[1] * w
    for k in range(2, stages + 1):
        mu = (2.0 * k - 1.0) / k * b[k] / b[k - 1]
        nu = -(k - 1.0) / k * b[k] / b[k - 2]
        weights[k - 1] = mu, nu, mu * w, -(1.0 - b[k - 1]) * mu * w
    return weights


class SuperSteps:
    """Second order in time and many explicit steps long; conserves what the exchange conserves."""

    def __init__(
        self,
        exchange: Exchange,
        substance: Substance,
        stages: int = STAGES,
        share: float = STEP_SHARE,
        threads: int = 1,
    ) -> None:
        """Choose the step.

        ``stages``: at most; shorter durations take fewer. ``share``: of (s^2 + s - 2)/4 stable
        explicit steps.
        """
        self.volume_m3 = exchange.volume_m3
        self._explicit_s = share * float(exchange.limit_s(substance.capacity_j_m3_k).min())
        self._most_stages = len(stage_weights(stages))
        self.step_s = self._explicit_s * _gain(stages)
        self._system, self._threads = heat_system(exchange, substance), threads

    def advance(self, heat: Heat, duration_s: float) -> None:
        """Take equal super steps over a duration, each of no more stages than it needs."""
        steps = max(1, math.ceil(duration_s / self.step_s * (1.0 - 1e-12)))
        stages = 3
        while stages < self._most_stages and (
            self._explicit_s * _gain(stages) < duration_s / steps * (1.0 - 1e-12)
        ):
            stages += 1
        weights = stage_weights(stages)
        set_num_threads(self._threads)
        heat.enthalpy_j_m3 = _super_steps(
            steps, duration_s / steps, heat.time_s, weights, self._system,
            heat.enthalpy_j_m3, heat.temperature_k, heat.noted,
        )  # fmt: skip
        heat.time_s += duration_s
        heat.element_steps += steps * stages * len(self._system.material)


def _gain(stages: int) -> float:
    """Explicit steps that a super step is long."""
    return (stages**2 + stages - 2) / 4.0


@njit(parallel=True)
def _taken(system: HeatSystem, temperature: Floats, taken: Floats) -> None:
    """Heat that each element takes up, W/m3, into an array."""
    start, neighbour, rate = system.start, system.neighbour, system.rate
    for i in prange(len(taken)):
        total = 0.0
        for k in range(start[i], start[i + 1]):
            total += rate[k] * (temperature[neighbour[k]] - temperature[i])
        taken[i] = total


@njit(parallel=True)
def _stage(
    weights: Floats, dt: float, begin: Floats, at_begin: Floats, last: Floats, older: Floats,
    taken: Floats, system: HeatSystem, temperature: Floats,
) -> None:  # fmt: skip
    """Stage j from the two before; the older one's array takes the new enthalpy."""
    material, rows, reference = system.material, system.rows, system.reference
    mu, nu, rise, rise_0 = weights[0], weights[1], weights[2] * dt, weights[3] * dt
    for i in prange(len(begin)):
        new = mu * last[i] + nu * older[i] + (1.0 - mu - nu) * begin[i]
        older[i] = new + rise * taken[i] + rise_0 * at_begin[i]
        temperature[i] = temperature_of(older[i], material[i], rows, reference)


@njit()
def _super_steps(
    steps: int, dt: float, time_s: float, weights: Floats, system: HeatSystem, enthalpy: Floats,
    temperature: Floats, noted: Floats,
) -> Floats:  # fmt: skip
    """Take super steps; temperatures and notes change in place, enthalpy comes back."""
    material, rows, reference = system.material, system.rows, system.reference
    n = len(enthalpy)
    begin, last, older = enthalpy.copy(), np.empty(n), np.empty(n)
    at_begin, taken = np.empty(n), np.empty(n)
    for step in range(steps):
        _taken(system, temperature, at_begin)
        older[:] = begin
        last[:] = begin
        _stage(weights[0], dt, begin, at_begin, last, older, at_begin, system, temperature)
        last, older = older, last
        for j in range(1, len(weights)):
            _taken(system, temperature, taken)
            _stage(weights[j], dt, begin, at_begin, last, older, taken, system, temperature)
            last, older = older, last
        for i in range(n):
            note(i, material[i], begin[i], last[i], time_s + step * dt, dt, rows, reference, noted)
        begin, last = last, begin
    return begin
