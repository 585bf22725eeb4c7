"""How a flow of metal is planned: a still tank, or a casting poured over a shoulder, by MPS."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

from sandmould.bad_input import Problem
from sandmould.casting.mps import computation, scene
from sandmould.kinds.casting import casting_planning
from sandmould.kinds.flow.limits import limit_problems
from sandmould.kinds.flow.measures import MEASURES
from sandmould.kinds.flow.speed import SPEED
from sandmould.kinds.kind import Note, SpeedClass
from sandmould.scenario.flow import MetalFlow, ShoulderedCylinder, StillTank

BASE_MEMORY_MB = 600
PARTICLES_PER_MB = 300
RECORD_BYTES = 28
"""Of a particle: seven float32."""
RATES = {2: 1e6, 3: 4e5}
"""Particle-solves a second of one core by dimension: 0.9e6 to 1.4e6 and 4.0e5 on the machine where
tank_small was first run; fixed, so that a study has the same batches everywhere."""


def problems(scenario: MetalFlow) -> list[Problem]:
    """What keeps it from being computed, too much of it first: that cannot be laid out."""
    return [*limit_problems(scenario)] or scene.problems(scenario)


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


def planned_s(scenario: MetalFlow) -> float:
    """Its duration."""
    return scenario.duration_s


def speed_class(scenario: MetalFlow) -> SpeedClass:
    """In the plane or in space."""
    return "mps", 2 if isinstance(scenario.case, StillTank) else 3


def plan_cells(scenario: MetalFlow) -> Mapping[str, str]:
    """Particles of metal, and how long they flow."""
    return {
        "particles": f"{scene.fluid_of(scenario):,}",
        "simulated": f"{scenario.duration_s:g} s",
    }


def notes(scenario: MetalFlow) -> Sequence[Note]:
    """Poured metal whose particles may pass through each other."""
    poured = isinstance(scenario.case, ShoulderedCylinder) and scenario.case.starts == "empty"
    if not poured or scenario.collision_distance > 0.0:
        return ()
    text = (
        "Metal is poured with collision_distance 0. Both settings of shoulder_pour broke off so "
        "before a quarter was poured; with 0.8 they ran to their end."
    )
    return (Note("collisions", text),)


PLANNING = casting_planning(
    computation,
    work_unit=computation.WORK,
    resolved=lambda scenario: scenario,  # it names no files
    problems=problems,
    measures=MEASURES,
    threads=threads,
    memory_mb=memory_mb,
    planned_work=planned_work,
    predicted_s=predicted_s,
    planned_s=planned_s,
    speed_class=speed_class,
    plan_cells=plan_cells,
    notes=notes,
    # beside them only files of the solver: with those it is computed again
    measuring=("sandmould/kinds/flow/execution.py",),
    speed=SPEED,
)
