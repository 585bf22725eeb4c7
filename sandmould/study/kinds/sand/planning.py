"""How a run of sand is planned: its engine, its price, what it is hashed by."""

from __future__ import annotations

import math
from collections.abc import Mapping
from pathlib import Path

import pattern_fe
from sandmould.digest import digest
from sandmould.engines import registry
from sandmould.engines.program import build_program
from sandmould.scenario import checks
from sandmould.scenario.placement import plan_counts
from sandmould.scenario.scenario import Scenario
from sandmould.scenario.solids import SolidMesh, with_hash
from sandmould.study.kinds.kind import MachineSpeed, Planning, SpeedClass
from sandmould.study.kinds.sand import speed

BASE_MEMORY_MB = 600
GRAINS_PER_MB = 50
SLOW_RATE = 1e6
"""Grain-steps per second of a slow core; benchmarks/ has those measured."""
IN_3D = 0.4
"""Share in 3D of an engine's speed in 2D."""
PASSES = 4.0
"""Times that a window of sand and pattern is computed, where it may be repeated: 3.2 to 4.3 in the
mean on the L while it is filled, in windows of 2 to 20 ms (study l_judged)."""


def resolved(scenario: Scenario) -> Scenario:
    """The scenario with its pattern's outline and the hashes of its meshes.

    So a changed mesh makes another run.
    """
    if scenario.pattern is not None:
        from pattern_fe.coupling.interface import with_surface  # scikit-fem: few studies need it

        scenario = with_surface(scenario)
    obstacles = tuple(with_hash(o) if isinstance(o, SolidMesh) else o for o in scenario.obstacles)
    return scenario.model_copy(update={"obstacles": obstacles})


def sources(scenario: Scenario) -> list[Path]:
    """Templates, and our own code where it computes."""
    ours = pattern_fe.source_files() if scenario.pattern else []
    return registry.deck_sources(scenario) + ours


def template_hash(scenario: Scenario) -> str:
    """Hash of all that turns a scenario into a deck, and of our code where it computes."""
    return registry.deck_hash(scenario) + (pattern_fe.source_hash() if scenario.pattern else "")


def computed_hash(scenario: Scenario) -> str:
    """Hash of what the engine is told to compute, and of the pattern beside it."""
    of_engine = registry.computed_hash(scenario)
    if scenario.pattern is None:
        return of_engine
    return digest(of_engine, scenario.pattern.model_dump_json(), pattern_fe.source_hash())


def vibration_s(scenario: Scenario) -> float:
    """The whole vibration."""
    return sum(stage.whole_duration_s for stage in scenario.vibrations)


def threads(scenario: Scenario) -> int:
    """Ranks of MPI, or threads."""
    return scenario.engine.ranks


def ranks(scenario: Scenario) -> int:
    """MPI ranks; the ranks of some engines are threads of one process."""
    return registry.mpi_ranks(scenario)


def memory_mb(scenario: Scenario) -> int:
    """Several times the 126 MB measured at 1 134 discs, 144 at 8 000."""
    return BASE_MEMORY_MB + sum(plan_counts(scenario)) // GRAINS_PER_MB


def allowed_s(scenario: Scenario) -> float:
    """Wall time on a machine slower than any measured."""
    return planned_work(scenario) / SLOW_RATE / scenario.engine.ranks


def planned_work(scenario: Scenario) -> float:
    """Steps times grains in the box at the time, and again where windows are repeated."""
    most = 1 if scenario.pattern is None else scenario.pattern.loop.most_passes
    return min(most, PASSES) * build_program(scenario).expected_grain_steps


def predicted_s(scenario: Scenario) -> float:
    """Wall time at fixed speeds."""
    in_3d = IN_3D if scenario.dimension == 3 else 1.0
    of_core = registry.engine_of(scenario).GRAIN_STEPS_PER_S
    return planned_work(scenario) / (of_core * scenario.engine.ranks * in_3d)


def planned_s(scenario: Scenario) -> float:
    """Fill, estimated, discharge, vibration and rest."""
    return build_program(scenario).expected_s


def planned_steps(scenario: Scenario) -> int:
    """Time steps of a run: its fill and its rests, estimated, and its vibration."""
    stages = build_program(scenario).stages
    return sum(math.ceil(stage.expected_s / scenario.step_s) for stage in stages)


def speed_class(scenario: Scenario) -> SpeedClass:
    """Engine and dimension."""
    return scenario.engine.name, scenario.dimension


def plan_cells(scenario: Scenario) -> Mapping[str, str]:
    """Grains, time step and steps."""
    return {
        "grains": f"{sum(plan_counts(scenario)):,}",
        "time step": f"{scenario.step_s:.3g} s",
        "steps": f"{planned_steps(scenario):,}",
    }


PLANNING = Planning[Scenario](
    work_unit="grain-steps",
    resolved=resolved,
    problems=checks.problems,
    engine_problem=registry.engine_problem,
    vibration_s=vibration_s,
    sources=sources,
    template_hash=template_hash,
    computed_hash=computed_hash,
    threads=threads,
    ranks=ranks,
    memory_mb=memory_mb,
    allowed_s=allowed_s,
    planned_work=planned_work,
    predicted_s=predicted_s,
    planned_s=planned_s,
    speed_class=speed_class,
    plan_cells=plan_cells,
    speed=MachineSpeed(speed.stored_rate, speed.measured_rate),
)
