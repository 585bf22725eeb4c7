"""How a flow of metal is planned: a still tank, or a casting poured over a shoulder, by MPS."""

from __future__ import annotations

import contextlib
import time
from collections.abc import Iterator, Mapping
from pathlib import Path

from sandmould.bad_input import Problem
from sandmould.casting.mps import computation, scene, source_hash
from sandmould.casting.mps.shoulder import PAPERS, POUR_M_S
from sandmould.casting.mps.stability_measures import beyond_map
from sandmould.kinds.casting import CastingPlanning
from sandmould.kinds.kind import BASE_MEMORY_MB, SpeedClass, StoredSpeed
from sandmould.limits import FRAMES, PARTICLES, RECORDS
from sandmould.runs.measures import once, read_groups
from sandmould.runs.templates import Note, notes
from sandmould.scenario.casting.flow import MetalFlow, StillTank

PARTICLES_PER_MB = 300
RECORD_BYTES = 28
"""Of a particle: seven float32."""
RATES = {2: 1e6, 3: 4e5}
"""Particle-solves a second of one core by dimension: 0.9e6 to 1.4e6 and 4.0e5 on the machine where
tank_small was first run; fixed, so that a study has the same batches everywhere."""
TIMED_S = 0.5
"""For how long metal flows to tell the speed of this machine."""


class FlowSpeed(StoredSpeed[MetalFlow]):
    """See ``StoredSpeed``."""

    def computed_by(self, scenario: MetalFlow) -> str:
        """What the speed depends on: our code, and the case, which has its dimension."""
        return f"mps {source_hash()} {scenario.case.kind}"

    def trial(self, scenario: MetalFlow, results: Path) -> float | None:
        """Particle-solves per second of one core, in the first steps; of a mould that is full."""
        flow = scene.open_flow(scenario, full=True)
        with contextlib.suppress(ArithmeticError):
            flow.step()  # compiled before it is timed
        before, begun_s = flow.cost.particle_solves, time.process_time()
        # what a guard stops so early has run for its share of the time
        with contextlib.suppress(ArithmeticError):
            while time.process_time() - begun_s < TIMED_S:
                flow.step()
        solves = flow.cost.particle_solves - before
        return solves / (time.process_time() - begun_s) if solves else None


class FlowPlanning(CastingPlanning[MetalFlow]):
    """See ``Planning``."""

    work_unit = computation.WORK
    solver = computation
    speed = FlowSpeed()
    measures = read_groups(
        Path(__file__).with_name("measures.yaml"),
        {
            "every flow; from measured_from_s on, where it says so": lambda _: once(),
            "at a probe, by its name; a flow without own probes has the paper's": lambda scenario: [
                probe.name for probe in scene.probes_of(scenario)
            ],
        },
    )
    # beside them only files of the solver: with those it is computed again
    measuring = (*CastingPlanning.measuring, "sandmould/kinds/flow/execution.py")

    def problems(self, scenario: MetalFlow) -> list[Problem]:
        """What keeps it from being computed, too much of it first: that cannot be laid out."""
        return [*_limit_problems(scenario)] or scene.problems(scenario)

    def memory_mb(self, scenario: MetalFlow) -> int:
        """Libraries, some 3 kB a particle for its pairs, and the records, held twice at the end."""
        particles, records = scene.fluid_of(scenario), scenario.duration_s / scenario.record_s
        return (
            BASE_MEMORY_MB
            + particles // PARTICLES_PER_MB
            + round(1e-6 * 2 * RECORD_BYTES * particles * records)
        )

    def planned_work(self, scenario: MetalFlow) -> float:
        """Particle-solves."""
        return scene.expected_work(scenario)

    def predicted_s(self, scenario: MetalFlow) -> float:
        """Wall time at a fixed speed."""
        return self.planned_work(scenario) / RATES[self.speed_class(scenario)[1]]

    def planned_s(self, scenario: MetalFlow) -> float:
        """Its duration."""
        return scenario.duration_s

    def speed_class(self, scenario: MetalFlow) -> SpeedClass:
        """In the plane or in space."""
        return "mps", 2 if isinstance(scenario.case, StillTank) else 3

    def plan_cells(self, scenario: MetalFlow) -> Mapping[str, str]:
        """Particles of metal, and how long they flow."""
        return {
            "particles": f"{scene.fluid_of(scenario):,}",
            "simulated": f"{scenario.duration_s:g} s",
        }

    def notes(self, scenario: MetalFlow) -> tuple[Note, ...]:
        """Where the method ends, and what its particles make of a casting."""
        pours = not isinstance(scenario.case, StillTank)
        return notes(
            "plan_flow.j2",
            pours=pours,
            passes=pours and scenario.collision_distance == 0.0,
            beyond=beyond_map(scenario),
            mass_percent=scene.mass_percent(scenario),
        )


def _limit_problems(scenario: MetalFlow) -> Iterator[Problem]:
    """List what a flow asks too much of, by its sizes and times alone."""
    case, metal = scenario.case, scenario.metal
    # divided one by one: a power of a tiny particle is no number
    side_m = case.particle_m
    if isinstance(case, StillTank):
        sites = (case.width_m / side_m) * (case.depth_m / side_m)
    else:
        sites = (PAPERS.lower_m / side_m) * (PAPERS.lower_m / side_m) * (PAPERS.height_m / side_m)
        across = case.rate_kg_s / metal.density_kg_m3 / POUR_M_S / side_m / side_m
        yield from PARTICLES.problems("case.rate_kg_s", across, case.rate_kg_s)
    yield from PARTICLES.problems("case.particle_m", sites, side_m)
    frames = scenario.duration_s / scenario.record_s
    yield from FRAMES.problems("record_s", frames, scenario.record_s)
    longest_s = scenario.dt_max_s  # a row of a table each, or more
    yield from RECORDS.problems("dt_max_s", scenario.duration_s / longest_s, longest_s)
