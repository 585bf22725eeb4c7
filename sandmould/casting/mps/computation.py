"""One run of a flow: from its scenario to pressures, fields, outcome and cost."""

from __future__ import annotations

import contextlib
import math
import time
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd

from sandmould.casting.mps import scene, source_hash
from sandmould.casting.mps import source_files as source_files
from sandmould.casting.mps.flow import EscapedError, Flow, FlowProgress
from sandmould.casting.mps.particles import WALL, Floats
from sandmould.casting.mps.pressure import ClosedRegionError
from sandmould.casting.mps.probes import Watch
from sandmould.casting.mps.scheme import G_M_S2
from sandmould.runs.checkpoint_file import CheckpointFile
from sandmould.runs.hashing import solution_hash
from sandmould.runs.outcome import Outcome, RunOutcome
from sandmould.runs.products import Computed, Cost, peak_memory_bytes
from sandmould.runs.progress import Progress
from sandmould.scenario.casting.flow import MetalFlow, StillTank

PRODUCTS = ("series.tsv", "fields.npz")
CHECKPOINT = "checkpoint.bin"
WORK = "particle-solves"
OF_FLUID = (
    "largest_speed_m_s", "mean_speed_m_s", "kinetic_energy_j_kg", "top_m", "largest_rise_m_s",
    "particles", "step_iterations",
)  # fmt: skip
"""Columns of ``series.tsv`` after the time and the probes."""


@dataclass
class FlowCost(Cost):
    """The cost row of a flow; compiling is left out of ``cpu_s``."""

    particles: int = 0
    particle_solves: int = 0
    poisson_iterations: int = 0
    solver_fraction: float = math.nan
    """Of the wall time of the steps, spent on the Poisson equation."""

    def columns(self) -> dict[str, Any]:
        """Columns of the cost row in ``products.json`` and their values."""
        rate = self.particle_solves / self.engine_wall_s if self.engine_wall_s > 0 else 0.0
        names = ("engine", "version", "ranks", "particles", "steps", "particle_solves",
                 "poisson_iterations", "solver_fraction", "time_step_s", "wall_s", "engine_wall_s",
                 "cpu_s", "peak_memory_bytes")  # fmt: skip
        return {name: getattr(self, name) for name in names} | {"particle_solves_per_s": rate}


def computed_hash(scenario: MetalFlow) -> str:
    """Hash of scenario and solver."""
    return solution_hash(scenario, source_hash())


def no_cost(scenario: MetalFlow) -> FlowCost:
    """Cost of a run that has not begun."""
    return FlowCost("mps", 1, math.nan, math.nan, source_hash())


def columns_of(scenario: MetalFlow) -> list[str]:
    """Columns of the probes."""
    return [f"{probe.name}_pa" for probe in scene.probes_of(scenario)]


def compute(scenario: MetalFlow, folder: Path, run: str) -> Computed:
    """Compute a flow from its newest checkpoint, or from its beginning.

    A tank is run to see whether its setting holds: a guard that stops it is the answer, and the run
    has finished. Pouring that a guard stops has failed. ``folder``: the run's; products are written
    to its ``work``. ``run``: its name, for the line of progress.
    """
    work = folder / "work"
    work.mkdir(parents=True, exist_ok=True)
    begun, cost = time.monotonic(), no_cost(scenario)
    progress = Progress(run, work, scene.expected_work(scenario), WORK)
    with contextlib.suppress(ArithmeticError):
        scene.open_flow(scenario).step()  # compiled before it is timed
    course = _Course(scenario, CheckpointFile(work / CHECKPOINT, computed_hash(scenario)))
    flow, outcome, detail = course.flow, Outcome.FINISHED, ""

    def show_progress(now: FlowProgress | None = None) -> None:
        done = flow.cost.particle_solves
        rate = done / max(flow.cost.wall_s, 1e-9)
        progress.show(course.stage, flow.time_s, done, rate, last=now is None)

    try:
        flow.advance(scenario.duration_s, course, show_progress)
    except ArithmeticError as stop:
        detail = str(stop)
        outcome = Outcome.FINISHED if isinstance(scenario.case, StillTank) else _outcome(stop)
    _count(cost, course)
    course.record.frame(flow)
    course.record.table(columns_of(scenario)).to_csv(
        work / "series.tsv", sep="\t", index=False, float_format="%.8g"
    )
    np.savez_compressed(work / "fields.npz", **course.record.fields(flow))
    cost.wall_s = course.before_s["wall_s"] + time.monotonic() - begun
    show_progress()
    return Computed(
        RunOutcome(outcome, detail, flow.time_s, scenario.duration_s), cost, is_root=True
    )


class _Course:
    """A run on its way: what flows, pours and is noted; call it after every step."""

    def __init__(self, scenario: MetalFlow, checkpoint: CheckpointFile) -> None:
        self.flow = scene.open_flow(scenario)
        self._ladle = scene.ladle_of(scenario, self.flow)
        up = -np.asarray(self.flow.metal.gravity_m_s2) / G_M_S2
        self.record = FlowRecord(scene.places_of(scenario), scenario.record_s, up)
        self._checkpoint = checkpoint
        self._clock_s = {"cpu_s": time.process_time(), "wall_s": time.monotonic()}
        self.before_s = dict.fromkeys(self._clock_s, 0.0)
        """Processor and wall time of the processes that computed this run before."""
        arrays = checkpoint.read()
        if arrays is None:
            self.record.frame(self.flow)
            return
        self.flow.take_up(arrays)
        self.record.take_up(arrays)
        self.before_s = {name: float(arrays[name]) for name in self._clock_s}
        if self._ladle:
            self._ladle.poured = int(arrays["poured"])

    def __call__(self, flow: Flow) -> None:
        """Pour what is due, note the step, and keep the run now and then."""
        if self._ladle:
            self._ladle(flow)
        self.record(flow)
        self._checkpoint.write_when_due(self._arrays)

    def _arrays(self) -> dict[str, Any]:
        poured = self._ladle.poured if self._ladle else 0
        return self.flow.arrays() | self.record.arrays() | self.spent_s() | {"poured": poured}

    def spent_s(self) -> dict[str, float]:
        """Processor and wall time since the run was opened, with those before."""
        now_s = {"cpu_s": time.process_time(), "wall_s": time.monotonic()}
        return {name: self.before_s[name] + now_s[name] - self._clock_s[name] for name in now_s}

    @property
    def stage(self) -> str:
        """What goes on, for the line of progress."""
        pours = self._ladle and self.flow.time_s < self._ladle.lasts_s
        return "pouring" if pours else "flowing"


def _outcome(stop: ArithmeticError) -> Outcome:
    """What a run ends with that a guard stopped."""
    if isinstance(stop, EscapedError):
        return Outcome.ESCAPED_METAL
    return Outcome.NO_FREE_SURFACE if isinstance(stop, ClosedRegionError) else Outcome.UNSTABLE


def _count(cost: FlowCost, course: _Course) -> None:
    flow, spent = course.flow, course.flow.cost
    cost.particles, cost.steps = int(flow.fluid.sum()), spent.steps
    cost.particle_solves, cost.poisson_iterations = spent.particle_solves, spent.iterations
    cost.engine_wall_s, cost.peak_memory_bytes = spent.wall_s, peak_memory_bytes()
    cost.time_step_s = flow.time_s / max(1, spent.steps)
    cost.solver_fraction = spent.pressure_s / spent.wall_s if spent.wall_s > 0 else math.nan
    cost.cpu_s = course.spent_s()["cpu_s"]


def complete(scenario: MetalFlow, work: Path) -> None:
    """Make an empty table of pressures where a broken run wrote none."""
    path = work / "series.tsv"
    if not path.exists():
        work.mkdir(parents=True, exist_ok=True)
        head = ["time_s", *columns_of(scenario), *OF_FLUID]
        path.write_text("\t".join(head) + "\n", encoding="utf-8")


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
