"""Studies of metal that flows: a still tank, or a casting poured over a shoulder, by MPS."""

from __future__ import annotations

from collections.abc import Mapping
from functools import partial
from pathlib import Path
from typing import Any

import pandas as pd

from sandmould.casting.mps import computation, scene
from sandmould.casting.mps.stability_measures import by_window, measure_flow
from sandmould.runs.outcome import RunOutcome
from sandmould.scenario.flow import MetalFlow, StillTank
from sandmould.study.kinds import own_solver
from sandmould.study.kinds.kind import SpeedClass
from sandmould.study.run import Run

MODEL = MetalFlow
WORK = computation.WORK
PRODUCTS = computation.PRODUCTS
BASE_MEMORY_MB = 600
PARTICLES_PER_MB = 300
RECORD_BYTES = 28
"""Of a particle: seven float32."""
RATES = {2: 1e6, 3: 4e5}
"""Particle-solves a second of one core by dimension: 0.9e6 to 1.4e6 and 4.0e5 on the machine where
tank_small was first run; fixed, so that a study has the same batches everywhere."""


def resolved(scenario: MetalFlow) -> MetalFlow:
    """The scenario: it names no files."""
    return scenario


def threads(scenario: MetalFlow) -> int:
    """One."""
    return 1


def memory_mb(scenario: MetalFlow) -> int:
    """Libraries, some 3 kB a particle for its pairs, and the records, held twice at the end."""
    particles, records = scene.fluid_of(scenario), scenario.duration_s / scenario.record_s
    return (
        BASE_MEMORY_MB
        + particles // PARTICLES_PER_MB
        + round(1e-6 * 2 * RECORD_BYTES * particles * records)
    )


def planned_work(scenario: MetalFlow) -> float:
    """Particle-solves."""
    return scene.expected_work(scenario)


def predicted_s(scenario: MetalFlow) -> float:
    """Wall time at a fixed speed."""
    return planned_work(scenario) / RATES[speed_class(scenario)[1]]


_given = own_solver.Given(computation, scene.problems, predicted_s)


def __getattr__(name: str) -> Any:
    """Entries that all kinds with our own solver have alike."""
    return getattr(_given, name)


def planned_s(scenario: MetalFlow) -> float:
    """Its duration."""
    return scenario.duration_s


def speed_class(scenario: MetalFlow) -> SpeedClass:
    """In the plane or in space."""
    return "mps", 2 if isinstance(scenario.case, StillTank) else 3


def rate(scenario: MetalFlow, results: Path) -> float:
    """The fixed speed."""
    return RATES[speed_class(scenario)[1]]


def plan_cells(scenario: MetalFlow) -> Mapping[str, str]:
    """Particles of metal, and how long they flow."""
    return {
        "particles": f"{scene.fluid_of(scenario):,}",
        "simulated": f"{scenario.duration_s:g} s",
    }


def measure(run: Run, folder: Path) -> None:
    """Write the measures against time, those of the whole run in every row, and the picture."""
    from analysis.flow_plots import draw_last

    scenario: MetalFlow = run.scenario
    outcome = RunOutcome.read(folder / "outcome.json")
    series = pd.read_csv(folder / "series.tsv", sep="\t")
    names = [probe.name for probe in scene.probes_of(scenario)]
    table = by_window(series, names, scenario.record_s)
    if table.empty:  # stopped in its first step: a row for the verdict all the same
        table.loc[0, "time_s"] = outcome.simulated_s
    table.insert(1, "vibration_time_s", -1.0)
    table.insert(2, "stage", "flowing")
    found = measure_flow(scenario, series, outcome.detail)
    for name in names:
        table[f"{name}_mean_pa"] = found.mean_pa[name]
        table[f"{name}_sd_pa"] = found.sd_pa[name]
        table[f"{name}_window_sd_pa"] = found.window_sd_pa[name]
        table[f"{name}_error_pa"] = found.mean_pa[name] - found.ideal_pa[name]
    table["peak_speed_m_s"] = found.peak_speed_m_s
    table["average_speed_m_s"] = found.average_speed_m_s
    table["hops"] = int(found.hops)
    table["classification"] = found.verdict.value
    own_solver.write_measures(folder, table)
    fields, highest_pa = own_solver.read_fields(folder), max(found.ideal_pa.values())
    draw = partial(draw_last, fields, highest_pa=highest_pa) if fields else None
    own_solver.write_picture(folder, (5, 6), draw)
