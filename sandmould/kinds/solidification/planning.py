"""How a solidification is planned: a casting in its mould, by particles of several sizes."""

from __future__ import annotations

from collections.abc import Mapping

from sandmould.bad_input import Problem
from sandmould.casting.arpm import computation, scene
from sandmould.casting.arpm.estimates import least_sand_share
from sandmould.kinds.casting import casting_planning
from sandmould.kinds.kind import SpeedClass
from sandmould.kinds.solidification.limits import limit_problems
from sandmould.kinds.solidification.measures import MEASURES
from sandmould.kinds.solidification.notes import notes
from sandmould.kinds.solidification.speed import SPEED
from sandmould.scenario.casting_shapes import with_file_hash
from sandmould.scenario.solidification import Solidification

BASE_MEMORY_MB = 600
ELEMENTS_PER_MB = 500
MEASURED_ELEMENT_S = 7e-6
"""Processor time beside the steps for an element: 6.4 us in bracket_freezes, 8.3 us in plates, 1.6
us in plates_small."""
RATE = 2e7
RATE_OF_DIFFERENCES = 1e8
"""Element-steps a second of one core: 1.9e7 and 1.3e8 on the machine where plates_small was first
run; fixed, so that a study has the same batches everywhere."""


def resolved(scenario: Solidification) -> Solidification:
    """The scenario with the hashes of its files, so that a changed mesh makes another run."""
    shapes = tuple(with_file_hash(shape) for shape in scenario.shapes)
    return scenario.model_copy(update={"shapes": shapes})


def problems(scenario: Solidification) -> list[Problem]:
    """What keeps it from being computed, too much of it first: that cannot be laid out."""
    return [*limit_problems(scenario)] or scene.problems(scenario)


def threads(scenario: Solidification) -> int:
    """Of one process."""
    return scenario.threads


def memory_mb(scenario: Solidification) -> int:
    """Libraries, and some 2 kB an element for the pairs of a kernel."""
    return BASE_MEMORY_MB + len(scene.elements_of(scenario).size_m) // ELEMENTS_PER_MB


def planned_work(scenario: Solidification) -> float:
    """Element-steps, by Chvorinov's rule."""
    return scene.expected_element_steps(scenario)


def predicted_s(scenario: Solidification) -> float:
    """Wall time at fixed speeds."""
    return planned_work(scenario) / (_speed(scenario) * scenario.threads)


def planned_s(scenario: Solidification) -> float:
    """Until all is solid, by Chvorinov's rule."""
    return scene.expected_s(scenario)


def speed_class(scenario: Solidification) -> SpeedClass:
    """Elements or finite differences; runs of one class may share a job."""
    return computation.engine_of(scenario), scenario.dimensions


def _speed(scenario: Solidification) -> float:
    return RATE_OF_DIFFERENCES if scenario.exchange == "difference" else RATE


def beside_s(scenario: Solidification) -> float:
    """Laying out, hot spots, files and the picture."""
    return MEASURED_ELEMENT_S * len(scene.elements_of(scenario).size_m)


def plan_cells(scenario: Solidification) -> Mapping[str, str]:
    """Elements, and the time at which all should be solid."""
    never = least_sand_share(scenario, scene.cooled_of(scenario)) >= 1.0
    return {
        "elements": f"{len(scene.elements_of(scenario).size_m):,}",
        "solid at about": "never" if never else f"{scene.expected_s(scenario):.0f} s",
    }


PLANNING = casting_planning(
    computation,
    work_unit="element-steps",
    resolved=resolved,
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
    measuring=("sandmould/analysis/freezing.py", "sandmould/kinds/solidification/execution.py"),
    speed=SPEED,
    beside_s=beside_s,
)
