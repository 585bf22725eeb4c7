"""A casting that solidifies in its mould: run until all of it is below the solidus."""

from __future__ import annotations

import math
import time
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np
from scipy.sparse import csr_array
from scipy.spatial import cKDTree

from sandmould.arrays import Floats
from sandmould.casting.arpm.elements import Elements
from sandmould.casting.arpm.filling import OUTSIDE, Filling, check_casting
from sandmould.casting.arpm.marching import Heat, Marching

REACH = 1.6
"""Of the nearest element's size: at least the elements all round a point, corners included."""


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


def probe_weights(elements: Elements, probes_m: Mapping[str, Floats]) -> csr_array:
    """Weights of the elements round each point that give a linear temperature exactly.

    Moving least squares over elements of the material that the point is in (Lancaster and
    Salkauskas, Mathematics of Computation 37 (1981) 141-158).

    Gives (len(probes_m), n) sparse float64. ``probes_m``: mapping of name to (d,) float64, m.

    Raises
    ------
    ValueError
        When a point lies outside the box.
    """
    rows = np.zeros(0, dtype=np.int64)
    columns, values = rows, np.zeros(0)
    tree = cKDTree(elements.position_m)
    for number, (name, place) in enumerate(probes_m.items()):
        place = np.asarray(place, dtype=np.float64)
        if place.shape != elements.low_m.shape:
            raise ValueError(f"probe {name} is at {place.tolist()}; it needs "
                             f"{elements.dimensions} coordinates")  # fmt: skip
        if (place < elements.low_m).any() or (place > elements.high_m).any():
            raise ValueError(
                f"probe {name} is at {place.tolist()} m; it must lie in the box from "
                f"{elements.low_m.tolist()} to {elements.high_m.tolist()} m"
            )
        used, weight = _weights(elements, tree, place)
        rows = np.append(rows, np.full(len(used), number))
        columns, values = np.append(columns, used), np.append(values, weight)
    return csr_array((values, (rows, columns)), (len(probes_m), len(elements.size_m)))


def _weights(elements: Elements, tree: cKDTree, place: Floats) -> tuple[Floats, Floats]:
    owner = _owner(elements, tree, place)
    own_size = elements.size_m[owner]
    near = np.array(tree.query_ball_point(place, REACH * 1.5 * own_size))
    near = near[elements.material[near] == elements.material[owner]]
    away = (elements.position_m[near] - place) / own_size
    # falls to nothing at the reach and is largest at the point itself
    share = np.maximum(1.0 - np.linalg.norm(away, axis=1) / (1.5 * REACH), 0.0) ** 4
    basis = np.hstack([np.ones((len(near), 1)), away])
    root = np.sqrt(share)[:, None]
    # the least-norm solution: a plate one element thick has no slope across it
    return near, np.linalg.pinv(basis * root, rcond=1e-9)[0] * root[:, 0]


def _owner(elements: Elements, tree: cKDTree, place: Floats) -> int:
    """The element whose square or cube holds a point, or the nearest centre."""
    near = tree.query(place, k=min(16, len(elements.size_m)))[1].reshape(-1)
    beyond = np.abs(elements.position_m[near] - place).max(axis=1) / elements.size_m[near]
    return int(near[np.argmin(beyond)])
