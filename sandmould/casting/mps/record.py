"""What a run of a flow leaves: pressures and speeds of every step, fields of some."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np
import pandas as pd

from sandmould.casting.mps.flow import Flow
from sandmould.casting.mps.particles import WALL, Floats
from sandmould.casting.mps.probes import Watch

OF_FLUID = (
    "largest_speed_m_s", "mean_speed_m_s", "kinetic_energy_j_kg", "top_m", "largest_rise_m_s",
    "particles", "step_iterations",
)  # fmt: skip
"""Columns of ``series.tsv`` after the time and the probes."""


class FlowRecord:
    """Collects what a run leaves; call it after every step."""

    def __init__(self, places: Sequence[Floats], every_s: float, up: Floats) -> None:
        """Record a flow.

        Parameters
        ----------
        places : sequence of (k, 3) float64, m
            Of each probe.
        every_s : float, s
            Between fields.
        up : (3,) float64
            Against gravity, of length 1.
        """
        self._watch = Watch(np.vstack(places))
        self._ends = np.cumsum([len(place) for place in places])[:-1]
        self._every_s, self._next_s = every_s, 0.0
        self._up = up
        self._rows: list[tuple[float, int, int]] = []
        self._times_s: list[float] = []
        self._frames: list[tuple[Any, ...]] = []
        """Positions, velocities and pressures of the metal."""

    def __call__(self, flow: Flow) -> None:
        """Note a step, and the field when a record is due."""
        self._watch(flow)
        rise = float((flow.particles.velocity_m_s[flow.fluid] @ self._up).max())
        self._rows.append((rise, int(flow.fluid.sum()), flow.cost.iterations))
        if flow.time_s >= self._next_s * (1.0 - 1e-9):
            self.frame(flow)
            self._next_s += self._every_s

    def frame(self, flow: Flow) -> None:
        """Note the field."""
        state, own = flow.particles, flow.fluid
        if not self._times_s or self._times_s[-1] < flow.time_s:
            fields = (state.position_m[own], state.velocity_m_s[own], flow.pressure_pa[own])
            self._times_s.append(flow.time_s)
            self._frames.append(tuple(field.astype(np.float32) for field in fields))

    def table(self, names: Sequence[str]) -> pd.DataFrame:
        """One row a step; a probe of several places shows their mean."""
        past = self._watch.history()
        rows = np.array(self._rows).reshape(-1, 3)
        probes = np.split(past.particle_pressure_pa, self._ends, axis=1)
        columns: dict[str, Any] = dict(
            zip(names, (each.mean(axis=1) for each in probes), strict=True)
        )
        iterations = np.diff(rows[:, 2], prepend=0.0)
        own = (past.largest_speed_m_s, past.mean_speed_m_s, past.kinetic_energy_j_kg, past.top_m,
               rows[:, 0], rows[:, 1].astype(int), iterations.astype(int))  # fmt: skip
        columns |= dict(zip(OF_FLUID, own, strict=True))
        return pd.DataFrame({"time_s": past.time_s, **columns})

    def fields(self, flow: Flow) -> dict[str, Any]:
        """Frames, one after the other: particles keep their order and new ones come last."""
        d = flow.kernel.dimension
        place, velocity, pressure = self._joined()
        wall = flow.particles.position_m[flow.particles.kind == WALL, :d]
        return {
            "time_s": np.array(self._times_s),
            "count": self._counts(),
            "position_m": place[:, :d],
            "velocity_m_s": velocity[:, :d],
            "pressure_pa": pressure,
            "wall_m": wall.astype(np.float32),
            "particle_m": flow.kernel.spacing_m,
        }

    def _joined(self) -> tuple[Any, ...]:
        return tuple(np.concatenate(field) for field in zip(*self._frames, strict=True))

    def _counts(self) -> Any:
        return np.array([len(frame[0]) for frame in self._frames])

    def arrays(self) -> dict[str, Any]:
        """All of it, for a checkpoint."""
        place, velocity, pressure = self._joined()
        return {
            "steps": np.array(self._watch.rows), "of_fluid": np.array(self._rows),
            "times_s": np.array(self._times_s), "counts": self._counts(),
            "places_m": place, "velocities_m_s": velocity, "pressures_pa": pressure,
            "next_record_s": self._next_s,
        }  # fmt: skip

    def take_up(self, arrays: Mapping[str, Any]) -> None:
        """Go on from what ``arrays`` gave."""
        self._watch.rows = [tuple(row) for row in arrays["steps"].tolist()]
        self._rows = [(rise, int(n), int(done)) for rise, n, done in arrays["of_fluid"].tolist()]
        self._times_s = arrays["times_s"].tolist()
        ends = np.cumsum(arrays["counts"])[:-1]
        names = ("places_m", "velocities_m_s", "pressures_pa")
        self._frames = list(zip(*(np.split(arrays[name], ends) for name in names), strict=True))
        self._next_s = float(arrays["next_record_s"])
