"""Local time steps: each element as long a step as it can, in powers of two.

An element's level is that of its own stable step. A pair exchanges heat at the pace of its faster
element, which sees the slower one's temperature held; the slower one takes up, at the end of its
step, the heat of its faster neighbours' temperatures integrated over it. Both sides count the
same heat, so nothing is lost at the borders of levels, and each update is a mean of temperatures
where each keeps its own stable step. The paper leaves this for later (section 4.4.3).
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np
from numba import prange, set_num_threads

from sandmould.arrays import Floats, Ints
from sandmould.casting.arpm.exchange import Exchange
from sandmould.casting.arpm.marching import STEP_SHARE, Heat, HeatSystem, Substance, note
from sandmould.casting.arpm.material import temperature_of
from sandmould.casting.arpm.varying import VaryingFaces, changed
from sandmould.compiled import njit

MOST_LEVELS = 8
LOOKED_AT = 64
"""Shortest steps after which it is looked whether conductances that vary are to be found anew."""


class Levels(NamedTuple):
    """Which elements step how often: at level k every 2^k of the shortest steps."""

    end: Ints
    """(levels,) int64: elements of a level and of those below come before it."""
    own: Ints
    """(n,) int64: level of each element, rising."""
    slowest: Ints
    fastest: Ints
    """(n,) int64: highest and lowest level among an element and its neighbours."""


class LocalSteps:
    """Forward Euler with a step of its own for each element."""

    def __init__(
        self,
        exchange: Exchange,
        substance: Substance,
        share: float = STEP_SHARE,
        most_levels: int = MOST_LEVELS,
        threads: int = 1,
    ) -> None:
        """Sort the elements by their steps.

        ``share``: of each element's longest stable step. ``most_levels``: elements never step more
        than 2 to this power less one times as long as others.
        """
        limit_s = share * exchange.limit_s(substance.capacity_j_m3_k)
        self._shortest_s = float(limit_s.min())
        octave = np.floor(np.log2(np.minimum(limit_s / self._shortest_s, 2.0**most_levels)))
        level = np.minimum(octave.astype(np.int64), most_levels - 1)
        self._threads = threads
        self._varying: VaryingFaces | None = None
        # as the heat has it, and in the order of levels
        self._rated_k = self._now_rated_k = np.empty(0)
        self._changed_k = math.inf
        self._order = np.argsort(level, kind="stable")
        self._sort(exchange, substance, level[self._order])
        self.volume_m3 = exchange.volume_m3
        self.step_s = self._shortest_s * 2.0 ** int(level.max())

    def _sort(self, exchange: Exchange, substance: Substance, level: Ints) -> None:
        """Bring everything into the order of levels: those who end a step are always the first."""
        order = self._order
        back = np.empty_like(order)
        back[order] = np.arange(len(order))
        count = np.diff(exchange.start)[order]
        start = np.concatenate([[0], np.cumsum(count)])
        entry = np.repeat(exchange.start[:-1][order] - start[:-1], count)
        entry += np.arange(len(entry))
        neighbour = back[exchange.neighbour[entry]].astype(np.int32)
        self._system = HeatSystem(
            start, neighbour, exchange.rate_w_m3_k[entry], substance.material[order],
            substance.table.rows, substance.table.reference_k,
        )  # fmt: skip
        if exchange.varying is not None:
            self._varying = exchange.varying.sorted(back, substance.material[order], entry)
            self._changed_k = self._varying.changed_k
        end = np.searchsorted(level, np.arange(int(level.max()) + 1), side="right")
        row = np.repeat(np.arange(len(level)), count)
        slowest, fastest = level.copy(), level.copy()
        np.maximum.at(slowest, row, level[neighbour])
        np.minimum.at(fastest, row, level[neighbour])
        self._levels = Levels(end, level, slowest, fastest)

    def advance(self, heat: Heat, duration_s: float) -> None:
        """Take whole cycles of the slowest elements' step over a duration."""
        count = len(self._levels.end)
        while count > 1 and self._shortest_s * 2.0 ** (count - 1) > duration_s:
            count -= 1
        substeps = 2 ** (count - 1)
        cycles = max(1, math.ceil(duration_s / (self._shortest_s * substeps) * (1.0 - 1e-12)))
        end = self._levels.end[:count].copy()
        end[-1] = len(self._order)
        top = count - 1
        levels = Levels(end, *(np.minimum(level, top) for level in self._levels[1:]))
        enthalpy, temperature, noted = (
            np.take(values, self._order, axis=-1)
            for values in (heat.enthalpy_j_m3, heat.temperature_k, heat.noted)
        )
        set_num_threads(self._threads)
        dt = duration_s / (cycles * substeps)
        integral, new = np.zeros((len(enthalpy), count)), np.empty(len(enthalpy))
        some = cycles if self._varying is None else max(1, LOOKED_AT // substeps)
        for begin in range(0, cycles, some):
            end_of = min(begin + some, cycles)
            self._follow(heat, temperature, heat.time_s + 0.5 * (begin + end_of) * substeps * dt)
            _local_steps(
                begin * substeps, end_of * substeps, dt, heat.time_s, levels, self._system,
                integral, enthalpy, temperature, noted, new,
            )  # fmt: skip
        heat.enthalpy_j_m3[self._order] = enthalpy
        heat.temperature_k[self._order] = temperature
        heat.noted[:, self._order] = noted
        if self._varying is not None:
            heat.rated_k[self._order] = self._now_rated_k
        heat.time_s += duration_s
        of_level = np.diff(np.concatenate([[0], end]))
        heat.element_steps += cycles * int((of_level * 2 ** np.arange(top, -1, -1)).sum())

    def _follow(self, heat: Heat, temperature_k: Floats, middle_s: float) -> None:
        """Find conductances anew where what they follow has changed; it may be another state's."""
        if self._varying is None:
            return
        is_known = heat.rated_k is self._rated_k
        if not is_known:
            self._rated_k, self._now_rated_k = heat.rated_k, heat.rated_k[self._order]
        if self._varying.over_time or changed(temperature_k, self._now_rated_k, self._changed_k):
            self._now_rated_k[:] = temperature_k
            self._rated_k = heat.rated_k = np.empty_like(temperature_k)
        elif is_known:
            return
        self._varying.find_rates(self._now_rated_k, middle_s, self._system.rate)


@njit(parallel=True)
def _update(
    ending: int, at: int, dt: float, time_s: float, levels: Levels, system: HeatSystem,
    integral: Floats, enthalpy: Floats, temperature: Floats, noted: Floats, new: Floats,
) -> None:  # fmt: skip
    """End the steps of the first elements: new enthalpies, and temperatures into ``new``."""
    start, neighbour, rate, material, rows, reference = system
    level, fastest = levels.own, levels.fastest
    for i in prange(ending):
        own_level = level[i]
        own_dt = dt * (1 << own_level)
        own, taken = temperature[i], 0.0
        if fastest[i] == own_level:
            for k in range(start[i], start[i + 1]):
                taken += rate[k] * (temperature[neighbour[k]] - own)
            taken *= own_dt
        else:
            for k in range(start[i], start[i + 1]):
                j = neighbour[k]
                if level[j] >= own_level:
                    other = own_dt * temperature[j]
                else:
                    other = integral[j, own_level] + dt * (1 << level[j]) * temperature[j]
                taken += rate[k] * (other - own_dt * own)
        before, m = enthalpy[i], material[i]
        after = before + taken
        enthalpy[i] = after
        new[i] = temperature_of(after, m, rows, reference)
        begin_s = time_s + at * dt - own_dt
        note(i, m, before, after, begin_s, own_dt, rows, reference, noted)


@njit(parallel=True)
def _integrate(
    ending: int,
    at: int,
    dt: float,
    levels: Levels,
    integral: Floats,
    temperature: Floats,
    new: Floats,
) -> None:
    """Add ended steps to the integrals that slower neighbours read, and take new temperatures."""
    level, slowest = levels.own, levels.slowest
    for i in prange(ending):
        for k in range(level[i] + 1, slowest[i] + 1):
            if at % (1 << k) == 0:
                integral[i, k] = 0.0
            else:
                integral[i, k] += dt * (1 << level[i]) * temperature[i]
        temperature[i] = new[i]


@njit()
def _local_steps(
    begin: int, stop: int, dt: float, time_s: float, levels: Levels, system: HeatSystem,
    integral: Floats, enthalpy: Floats, temperature: Floats, noted: Floats, new: Floats,
) -> None:  # fmt: skip
    """Take shortest steps between two ends of cycles of 2^(levels - 1), where integrals are 0."""
    end = levels.end
    for at in range(begin + 1, stop + 1):
        highest = 0
        while highest < len(end) - 1 and at % (1 << (highest + 1)) == 0:
            highest += 1
        ending = end[highest]
        _update(ending, at, dt, time_s, levels, system, integral, enthalpy, temperature, noted,
                new)  # fmt: skip
        _integrate(ending, at, dt, levels, integral, temperature, new)
