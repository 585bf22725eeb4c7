"""A casting that solidifies in its mould: run until all of it is below the solidus."""

from __future__ import annotations

import math
import time
from collections.abc import Callable, Mapping
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from sandmould.casting.arpm.elements import Elements
from sandmould.casting.arpm.filling import Filling, check_casting
from sandmould.casting.arpm.marching import Heat, Marching
from sandmould.casting.arpm.probes import probe_weights

Array = NDArray[np.float64]
OUTSIDE = 0.05
"""Of the range of initial temperatures: farther out no stable step leads."""


class UnstableError(RuntimeError):
    """Temperatures left the range of those at the start, or are no numbers."""


@dataclass(frozen=True)
class Progress:
    """How far a run is."""

    time_s: float
    percent: float
    """Of the casting's volume that is below the solidus, or of the time limit if that is more."""
    element_steps_per_s: float


@dataclass(frozen=True)
class Solidification:
    """What a run found."""

    time_s: Array
    """(k,) float64, s: of the records, from 0 on."""
    probe_k: dict[str, Array]
    """Cooling curve of each probe, (k,) float64, K."""
    enthalpy_j: Array
    """(k,) float64, J, or J/m in 2D: of all elements, from the coldest initial temperature."""
    heat: Heat
    """At the end."""
    solidification_time_s: float
    """When the last element fell below its solidus; NaN where the time limit came before."""
    cpu_s: float
    wall_s: float

    @property
    def drift_percent(self) -> Array:
        """Change of the total enthalpy over the first, (k,) float64, %: Fig. 14."""
        return np.asarray(100.0 * (self.enthalpy_j / self.enthalpy_j[0] - 1.0))


def solidify(
    elements: Elements,
    filling: Filling,
    marching: Marching,
    probes_m: Mapping[str, Array] | None = None,
    record_s: float = 5.0,
    until_s: float = 20_000.0,
    progress: Callable[[Progress], None] | None = None,
) -> Solidification:
    """Cool a casting until all of it is below its solidus.

    Parameters
    ----------
    elements : Elements
    filling : Filling
    marching : Marching
        Made of the same elements.
    probes_m : mapping of name to (d,) float64, m, optional
    record_s : float, s
        Between records; steps are cut so that they end at them.
    until_s : float, s
        The run ends here if something is still liquid.
    progress : callable, optional
        Told after each record.

    Returns
    -------
    Solidification

    Raises
    ------
    ValueError
        When there is no casting or no mould, a probe lies outside, or a time is not above 0.
    UnstableError
        When temperatures leave the range of those at the start.
    """
    if not (record_s > 0.0 and until_s > 0.0):
        raise ValueError(f"record_s is {record_s} and until_s {until_s}; both must be above 0")
    check_casting(elements, filling)
    heat, melts = filling.heat(elements), filling.melts(elements)
    weights = probe_weights(elements, probes_m or {})
    begun, begun_cpu = time.perf_counter(), time.process_time()
    records = [(0.0, weights @ heat.temperature_k, heat.enthalpy_j_m3 @ marching.volume_m3)]
    volume = marching.volume_m3[melts]
    solidus_j_m3 = filling.table.rows[elements.material[melts], 1]
    frozen = np.zeros(len(volume), dtype=np.bool_)
    for number in range(1, int(np.ceil(until_s / record_s)) + 1):
        target_s = min(number * record_s, until_s)
        marching.advance(heat, target_s - heat.time_s)
        heat.time_s = target_s
        _check_range(heat, filling)
        total = heat.enthalpy_j_m3 @ marching.volume_m3
        records.append((target_s, weights @ heat.temperature_k, total))
        frozen = heat.enthalpy_j_m3[melts] < solidus_j_m3
        if progress:
            share = max(volume[frozen].sum() / volume.sum(), target_s / until_s)
            rate = heat.element_steps / (time.perf_counter() - begun)
            progress(Progress(target_s, 100.0 * float(share), rate))
        if frozen.all():
            break
    times, curves, totals = zip(*records, strict=True)
    return Solidification(
        np.array(times),
        dict(zip(probes_m or {}, np.array(curves).T, strict=True)),
        np.array(totals),
        heat,
        float(heat.frozen_s[melts].max()) if frozen.all() else math.nan,
        time.process_time() - begun_cpu,
        time.perf_counter() - begun,
    )


def _check_range(heat: Heat, filling: Filling) -> None:
    low, high = min(filling.initial_k), max(filling.initial_k)
    beyond = OUTSIDE * (high - low)
    coldest, hottest = float(heat.temperature_k.min()), float(heat.temperature_k.max())
    if not low - beyond <= coldest <= hottest <= high + beyond:
        raise UnstableError(
            f"at {heat.time_s:g} s temperatures reach from {coldest:g} to {hottest:g} K, though "
            f"all began between {low:g} and {high:g} K; the time step is too long"
        )
