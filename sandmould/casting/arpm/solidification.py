"""A casting that solidifies in its mould: run until all of it is below the solidus."""

from __future__ import annotations

import math
import time
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np
from scipy.sparse import csr_array

from sandmould.arrays import Floats
from sandmould.casting.arpm.elements import Elements
from sandmould.casting.arpm.filling import OUTSIDE, Filling, check_casting
from sandmould.casting.arpm.marching import Heat, Marching
from sandmould.casting.arpm.probes import probe_weights


class UnstableError(RuntimeError):
    """Temperatures left the range of those at the start, or are no numbers."""


@dataclass(frozen=True)
class CoolingProgress:
    """How far a run is."""

    time_s: float
    percent: float
    """Of the casting's volume that is below the solidus, or of the time limit if that is more."""
    element_steps_per_s: float
    element_steps: int


@dataclass(frozen=True)
class SolidificationResult:
    """What a run found."""

    time_s: Floats
    """(k,) float64, s: of the records, from 0 on."""
    probe_k: dict[str, Floats]
    """Cooling curve of each probe, (k,) float64, K."""
    enthalpy_j: Floats
    """(k,) float64, J, or J/m in 2D: of all elements, from the coldest initial temperature."""
    heat: Heat
    """At the end."""
    solidification_time_s: float
    """When the last element fell below its solidus; NaN where the time limit came before."""
    cpu_s: float
    """Of the steps and records, those before a checkpoint included."""
    wall_s: float

    @property
    def drift_percent(self) -> Floats:
        """Change of the total enthalpy over the first, (k,) float64, %: Fig. 14."""
        return np.asarray(100.0 * (self.enthalpy_j / self.enthalpy_j[0] - 1.0))


@dataclass
class Cooling:
    """A run on its way: its heat, and what was recorded."""

    heat: Heat
    time_s: list[float]
    probe_k: list[Floats]
    """One (probes,) float64 a record, K."""
    enthalpy_j: list[float]
    cpu_s: float = 0.0
    wall_s: float = 0.0

    def arrays(self) -> dict[str, Any]:
        """All of it as arrays, for a checkpoint."""
        return vars(self.heat) | {
            "times_s": self.time_s, "probe_k": np.array(self.probe_k),
            "enthalpies_j": self.enthalpy_j, "cpu_s": self.cpu_s, "wall_s": self.wall_s,
        }  # fmt: skip

    @classmethod
    def of(cls, arrays: Mapping[str, Any]) -> Cooling:
        """Take up what ``arrays`` gave."""
        heat = Heat(
            arrays["enthalpy_j_m3"], arrays["temperature_k"], arrays["noted"],
            arrays["rated_k"], float(arrays["time_s"]), int(arrays["element_steps"]),
        )  # fmt: skip
        return cls(
            heat, arrays["times_s"].tolist(), list(arrays["probe_k"]),
            arrays["enthalpies_j"].tolist(), float(arrays["cpu_s"]), float(arrays["wall_s"]),
        )  # fmt: skip


def solidify(
    elements: Elements,
    filling: Filling,
    marching: Marching,
    probes_m: Mapping[str, Floats] | None = None,
    record_s: float = 5.0,
    until_s: float = 20_000.0,
    progress: Callable[[CoolingProgress], None] | None = None,
    start: Cooling | None = None,
    keep: Callable[[Cooling], None] | None = None,
) -> SolidificationResult:
    """Cool a casting until all of it is below its solidus.

    Parameters
    ----------
    marching : Marching
        Made of the same elements.
    probes_m : mapping of name to (d,) float64, m, optional
    record_s : float, s
        Between records; steps are cut so that they end at them.
    until_s : float, s
        The run ends here if something is still liquid.
    progress : callable, optional
        Told after each record.
    start : Cooling, optional
        Where another run of the same arguments was; the rest comes out bit for bit as in one run.
    keep : callable, optional
        Given the state after each record.

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
    melts = filling.melts(elements)
    weights = probe_weights(elements, probes_m or {})
    now = start or _beginning(filling.heat(elements), marching, weights)
    heat, clock = now.heat, _Clock(now)
    volume = marching.volume_m3[melts]
    solidus_j_m3 = filling.table.rows[elements.material[melts], 1]
    frozen = heat.enthalpy_j_m3[melts] < solidus_j_m3
    for number in range(len(now.time_s), int(np.ceil(until_s / record_s)) + 1):
        if frozen.all():
            break
        target_s = min(number * record_s, until_s)
        marching.advance(heat, target_s - heat.time_s)
        heat.time_s = target_s
        _check_range(heat, filling)
        _record(now, marching, weights)
        clock.read()
        frozen = heat.enthalpy_j_m3[melts] < solidus_j_m3
        if progress:
            share = max(volume[frozen].sum() / volume.sum(), target_s / until_s)
            rate = heat.element_steps / now.wall_s
            progress(CoolingProgress(target_s, 100.0 * float(share), rate, heat.element_steps))
        if keep:
            keep(now)
    return SolidificationResult(
        np.array(now.time_s),
        dict(zip(probes_m or {}, np.array(now.probe_k).T, strict=True)),
        np.array(now.enthalpy_j),
        heat,
        float(heat.frozen_s[melts].max()) if frozen.all() else math.nan,
        now.cpu_s,
        now.wall_s,
    )


class _Clock:
    """Adds what a run costs from now on."""

    def __init__(self, cooling: Cooling) -> None:
        self._cooling = cooling
        self._cpu_s = cooling.cpu_s - time.process_time()
        self._wall_s = cooling.wall_s - time.perf_counter()

    def read(self) -> None:
        self._cooling.cpu_s = self._cpu_s + time.process_time()
        self._cooling.wall_s = self._wall_s + time.perf_counter()


def _beginning(heat: Heat, marching: Marching, weights: csr_array) -> Cooling:
    now = Cooling(heat, [], [], [])
    _record(now, marching, weights)
    return now


def _record(now: Cooling, marching: Marching, weights: csr_array) -> None:
    now.time_s.append(now.heat.time_s)
    now.probe_k.append(np.asarray(weights @ now.heat.temperature_k))
    # not a product of BLAS: its threads wait for one another longer than a record takes
    now.enthalpy_j.append(float(np.sum(now.heat.enthalpy_j_m3 * marching.volume_m3)))


def _check_range(heat: Heat, filling: Filling) -> None:
    low, high = min(filling.initial_k), max(filling.initial_k)
    beyond = OUTSIDE * (high - low)
    coldest, hottest = float(heat.temperature_k.min()), float(heat.temperature_k.max())
    if not low - beyond <= coldest <= hottest <= high + beyond:
        raise UnstableError(
            f"at {heat.time_s:g} s temperatures reach from {coldest:g} to {hottest:g} K, though "
            f"all began between {low:g} and {high:g} K; the time step is too long"
        )
