"""The state of heat in elements, and explicit steps of the enthalpy method, eq. (5).

Super time steps are Runge-Kutta-Legendre of second order, many cheap stages for one long step.
Meyer, Balsara and Aslam, Journal of Computational Physics 257 (2014) 594-626: s stages reach
(s^2 + s - 2)/4 explicit steps.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Any, NamedTuple, Protocol

import numpy as np
from numba import prange, set_num_threads
from numpy.typing import NDArray

from sandmould.arrays import Floats, Ints
from sandmould.casting.arpm.exchange import Exchange
from sandmould.casting.arpm.material import EnthalpyTable, temperature_of
from sandmould.compiled import njit

STEP_SHARE = 0.95
"""Of the longest stable step, taken by default."""
STAGES = 9
"""Odd numbers damp better (Meyer et al., section 2)."""


@dataclass
class Heat:
    """What changes while elements cool."""

    enthalpy_j_m3: Floats
    """(n,) float64, J/m3."""
    temperature_k: Floats
    """(n,) float64, K."""
    noted: Floats
    """(3, n) float64: when each fell below its solidus, s, NaN before, once molten again, and where
    nothing melts; when each last cooled to where gradients are read, s, and how fast, K/s."""
    rated_k: Floats
    """(n,) float64, K: of which conductances that vary were found; NaN before they were."""
    time_s: float = 0.0
    element_steps: int = 0
    """Evaluations of (5) for one element so far."""

    @property
    def frozen_s(self) -> Floats:
        """When each fell below its solidus, (n,) float64, s."""
        return self.noted[0]


@dataclass(frozen=True)
class Substance:
    """Of what the elements are made, as compiled code wants it."""

    material: Ints
    """(n,) int64."""
    table: EnthalpyTable

    @property
    def capacity_j_m3_k(self) -> Floats:
        """Heat capacity without latent heat, (n,) float64, J/m3/K."""
        return self.table.rows[self.material, 0]

    def heat_at(self, temperature_k: Floats) -> Heat:
        """Heat of elements at temperatures, (n,) float64, K."""
        enthalpy = self.table.enthalpy_j_m3(temperature_k, self.material)
        noted = np.full((4, len(enthalpy)), np.nan)
        return Heat(enthalpy, temperature_k.astype(np.float64), noted[:3], noted[3])


class HeatSystem(NamedTuple):
    """Elements, their exchange and their materials; compiled code takes it."""

    start: Ints
    neighbour: NDArray[np.int32]
    rate: Floats
    """See ``Exchange``."""
    material: Ints
    """(n,) int64."""
    rows: Floats
    reference: float
    """See ``EnthalpyTable``."""


def heat_system(exchange: Exchange, substance: Substance) -> HeatSystem:
    """What an exchange and a substance make together.

    Raises
    ------
    ValueError
        When conductances vary, which local steps alone follow.
    """
    if exchange.varying is not None:
        raise ValueError("conductances that vary need local steps")
    return HeatSystem(
        exchange.start,
        exchange.neighbour,
        exchange.rate_w_m3_k,
        substance.material,
        substance.table.rows,
        substance.table.reference_k,
    )


class Marching(Protocol):
    """One way to go forward in time."""

    step_s: float
    """Longest step that it takes."""
    volume_m3: Floats

    def advance(self, heat: Heat, duration_s: float) -> None:
        """Change the heat by what a duration does."""


class ExplicitSteps:
    """Forward Euler with one step for all elements, as in the paper."""

    def __init__(
        self,
        exchange: Exchange,
        substance: Substance,
        share: float = STEP_SHARE,
        threads: int = 1,
    ) -> None:
        """Choose the step.

        ``share``: of the longest step that keeps temperatures between those of the neighbours.
        ``threads``: results do not depend on it.
        """
        self.volume_m3 = exchange.volume_m3
        self.step_s = share * float(exchange.limit_s(substance.capacity_j_m3_k).min())
        self._system, self._threads = heat_system(exchange, substance), threads

    def advance(self, heat: Heat, duration_s: float) -> None:
        """Take equal steps over a duration, none longer than ``step_s``."""
        steps = max(1, math.ceil(duration_s / self.step_s * (1.0 - 1e-12)))
        set_num_threads(self._threads)
        heat.temperature_k = _explicit_steps(
            steps, duration_s / steps, heat.time_s, self._system,
            heat.enthalpy_j_m3, heat.temperature_k, heat.noted,
        )  # fmt: skip
        heat.time_s += duration_s
        heat.element_steps += steps * len(self._system.material)


@njit(inline="always")
def note(
    i: int,
    m: int,
    before: float,
    after: float,
    begin_s: float,
    dt: float,
    rows: Any,
    reference: float,
    noted: Any,
) -> None:
    """Note what an element of material m passed as its enthalpy changed within a step."""
    solid, read = rows[m, 1], rows[m, 5]
    if before >= solid > after:
        noted[0, i] = begin_s + (before - solid) / (before - after) * dt
    elif after >= solid > before:
        noted[0, i] = np.nan
    if before >= read > after:
        noted[1, i] = begin_s + (before - read) / (before - after) * dt
        fell = temperature_of(before, m, rows, reference) - temperature_of(
            after, m, rows, reference
        )
        noted[2, i] = fell / dt


@njit(parallel=True)
def _explicit_steps(
    steps: int, dt: float, time_s: float, system: HeatSystem, enthalpy: Floats, temperature: Floats,
    noted: Floats,
) -> Floats:  # fmt: skip
    """Take explicit steps; an element sums its neighbours in order: threads change nothing."""
    start, neighbour, rate, material, rows, reference = system
    n = len(enthalpy)
    now, then = temperature.copy(), np.empty(n)
    for step in range(steps):
        for i in prange(n):
            own, taken = now[i], 0.0
            for k in range(start[i], start[i + 1]):
                taken += rate[k] * (now[neighbour[k]] - own)
            before, m = enthalpy[i], material[i]
            after = before + dt * taken
            enthalpy[i] = after
            then[i] = temperature_of(after, m, rows, reference)
            note(i, m, before, after, time_s + step * dt, dt, rows, reference, noted)
        now, then = then, now
    return now


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
