"""One run of a flow: from its scenario to pressures, fields, outcome and cost."""

from __future__ import annotations

import contextlib
import hashlib
import math
import time
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd

from sandmould.casting.mps import scene
from sandmould.casting.mps.flow import EscapedError, Flow
from sandmould.casting.mps.flow import Progress as Flowed
from sandmould.casting.mps.particles import WALL, Floats
from sandmould.casting.mps.pressure import ClosedRegionError
from sandmould.casting.mps.probes import Watch
from sandmould.engines.outcome import Outcome, RunOutcome
from sandmould.engines.products import Computed, Cost, peak_memory_bytes
from sandmould.engines.progress import Progress
from sandmould.scenario.flow import MetalFlow, StillTank

PRODUCTS = ("series.tsv", "fields.npz")
OF_FLUID = (
    "largest_speed_m_s", "mean_speed_m_s", "kinetic_energy_j_kg", "top_m", "largest_rise_m_s",
    "particles", "step_iterations",
)  # fmt: skip
"""Columns of ``series.tsv`` after the time and the probes."""


@dataclass
class FlowCost(Cost):
    """The cost row of a flow; compiling is left out of ``cpu_s``."""

    particles: int = 0
    particle_steps: int = 0
    poisson_iterations: int = 0
    solver_fraction: float = math.nan
    """Of the wall time of the steps, spent on the Poisson equation."""

    def columns(self) -> dict[str, Any]:
        """Columns of ``cost.tsv`` and their values."""
        rate = self.particle_steps / self.engine_wall_s if self.engine_wall_s > 0 else 0.0
        names = ("engine", "version", "ranks", "particles", "steps", "particle_steps",
                 "poisson_iterations", "solver_fraction", "time_step_s", "wall_s", "engine_wall_s",
                 "cpu_s", "peak_memory_bytes")  # fmt: skip
        return {name: getattr(self, name) for name in names} | {"particle_steps_per_s": rate}


def source_files() -> list[Path]:
    """Files of the solver."""
    return sorted(Path(__file__).parent.glob("*.py"))


def source_hash() -> str:
    """State of the solver, which stands in place of a version."""
    return hashlib.sha256(b"".join(f.read_bytes() for f in source_files())).hexdigest()[:12]


def no_cost(scenario: MetalFlow) -> FlowCost:
    """Cost of a run that has not begun."""
    return FlowCost("mps", 1, math.nan, math.nan, source_hash())


class _Record:
    """Collects what a run leaves; pass it to ``Flow.advance`` as ``each``."""

    def __init__(self, places: Sequence[Floats], every_s: float, up: Floats) -> None:
        self._watch = Watch(np.vstack(places))
        self._ends = np.cumsum([len(place) for place in places])[:-1]
        self._every_s, self._next_s = every_s, 0.0
        self._up = up
        self._rows: list[tuple[float, int, int]] = []
        self._frames: list[tuple[Any, ...]] = []
        """Time, and positions, velocities and pressures of the metal."""

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
        if not self._frames or self._frames[-1][0] < flow.time_s:
            fields = (state.position_m[own], state.velocity_m_s[own], flow.pressure_pa[own])
            self._frames.append((flow.time_s, *(field.astype(np.float32) for field in fields)))

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
        place, velocity, pressure = (
            np.concatenate([frame[field] for frame in self._frames]) for field in (1, 2, 3)
        )
        wall = flow.particles.position_m[flow.particles.kind == WALL, :d]
        return {
            "time_s": np.array([frame[0] for frame in self._frames]),
            "count": np.array([len(frame[1]) for frame in self._frames]),
            "position_m": place[:, :d],
            "velocity_m_s": velocity[:, :d],
            "pressure_pa": pressure,
            "wall_m": wall.astype(np.float32),
            "particle_m": flow.kernel.spacing_m,
        }


def columns_of(scenario: MetalFlow) -> list[str]:
    """Columns of the probes."""
    return [f"{probe.name}_pa" for probe in scene.probes_of(scenario)]


def compute(scenario: MetalFlow, folder: Path, run: str) -> Computed:
    """Compute a flow from its beginning: runs leave no checkpoint.

    A tank is run to see whether its setting holds: a guard that stops it is the answer, and the
    run has finished. Pouring that a guard stops has failed.

    Parameters
    ----------
    scenario : MetalFlow
    folder : Path
        The run's; products are written to its ``work``.
    run : str
        Its name, for the line of progress.
    """
    work = folder / "work"
    work.mkdir(parents=True, exist_ok=True)
    begun, cost = time.monotonic(), no_cost(scenario)
    planned = scene.expected_work(scenario)
    shown = Progress(run, work, planned, "particle-solves")
    with contextlib.suppress(ArithmeticError):
        scene.open_flow(scenario).step()  # compiled before it is timed
    flow = scene.open_flow(scenario)
    ladle = scene.ladle_of(scenario, flow)
    up = -np.asarray(flow.metal.gravity_m_s2) / scenario.metal.gravity_m_s2
    record = _Record(scene.places_of(scenario), scenario.record_s, up)
    record.frame(flow)

    def each(now: Flow) -> None:
        if ladle:
            ladle(now)
        record(now)

    def stage() -> str:
        return "pouring" if ladle and flow.time_s < ladle.lasts_s else "flowing"

    def tell(now: Flowed) -> None:
        done = 0.01 * now.percent * planned
        shown.show(stage(), now.time_s, done, done / flow.cost.wall_s)

    stepping, outcome = time.process_time(), Outcome.FINISHED
    detail = ""
    try:
        flow.advance(scenario.duration_s, each, tell)
    except ArithmeticError as stop:
        detail = str(stop)
        outcome = Outcome.FINISHED if isinstance(scenario.case, StillTank) else _outcome(stop)
    cost.cpu_s = time.process_time() - stepping
    _count(cost, flow)
    record.frame(flow)
    record.table(columns_of(scenario)).to_csv(
        work / "series.tsv", sep="\t", index=False, float_format="%.8g"
    )
    np.savez_compressed(work / "fields.npz", **record.fields(flow))
    cost.wall_s = time.monotonic() - begun
    done = planned * flow.time_s / scenario.duration_s
    shown.show(stage(), flow.time_s, done, done / max(cost.engine_wall_s, 1e-9), last=True)
    return Computed(
        RunOutcome(outcome, detail, flow.time_s, scenario.duration_s), cost, is_root=True
    )


def _outcome(stop: ArithmeticError) -> Outcome:
    """What a run ends with that a guard stopped."""
    if isinstance(stop, EscapedError):
        return Outcome.ESCAPED_METAL
    return Outcome.NO_FREE_SURFACE if isinstance(stop, ClosedRegionError) else Outcome.UNSTABLE


def _count(cost: FlowCost, flow: Flow) -> None:
    """Take over what the flow has counted."""
    spent = flow.cost
    cost.particles, cost.steps = int(flow.fluid.sum()), spent.steps
    cost.particle_steps, cost.poisson_iterations = spent.particle_steps, spent.iterations
    cost.engine_wall_s, cost.peak_memory_bytes = spent.wall_s, peak_memory_bytes()
    cost.time_step_s = flow.time_s / max(1, spent.steps)
    cost.solver_fraction = spent.pressure_s / spent.wall_s if spent.wall_s > 0 else math.nan


def complete(scenario: MetalFlow, work: Path) -> None:
    """Make an empty table of pressures where a broken run wrote none."""
    path = work / "series.tsv"
    if not path.exists():
        work.mkdir(parents=True, exist_ok=True)
        head = ["time_s", *columns_of(scenario), *OF_FLUID]
        path.write_text("\t".join(head) + "\n", encoding="utf-8")
