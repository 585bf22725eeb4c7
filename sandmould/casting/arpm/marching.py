"""The state of heat in elements, and explicit steps of the enthalpy method, eq. (5)."""

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
