"""How long stages and whole runs last: exact where it is given, foretold where sand must rest.

No result depends on what is foretold here: prices, progress and records of what was planned do.
Beside it the cost of a run that has not begun.
"""

from __future__ import annotations

import math

from sandmould.engines.bed_step import with_bed_step
from sandmould.engines.program import Program, Stage
from sandmould.runs.products import Cost
from sandmould.scenario.placement import fall_s, filled_measure
from sandmould.scenario.scenario import Scenario
from sandmould.scenario.stages import StageKind

OUTFLOW = {2: 0.78, 3: 0.43}
"""Solid measure that flows through an outlet in the time w^(1/2 - d) / sqrt(g), w its width less
``EDGE`` grains. In 2D measured, 0.65 without the edge at seven largest grains; in 3D the 0.58 of
Beverloo et al., Chem. Eng. Sci. 15 (1961) 260, for bulk measure and a round outlet, as 0.74 of the
area of a square one, times a solid fraction of 0.58."""
EDGE = 1.4
"""Median grains along the edge of an outlet through which nothing flows (Beverloo et al. 1961)."""
REST_AFTER_FLOW_S = 1.3
"""Guess of the time until the last grains of a heap have rolled out: with it nine recorded studies
of hoppers needed 0.68 to 1.39 times the grain-steps that are foretold for the whole run."""
REST_AFTER_FALL_S = 0.4
"""Guess of the time a bed needs to come to rest after the last grain has landed: 0.22 to 0.43 s on
average in each of six studies of boxes in 2D and 3D, 0.27 to 1.14 s round a pattern."""
REST_AFTER_MOTION_S = 0.1
"""Guess of the time a bed needs to come to rest once box or piston stands: 0.06 to 0.12 s on
average in each of seven studies of hard sand in 2D and 3D, 0.17 s in one of soft sand."""
LIMIT_OF_BED = 1.2
"""Guess of the exact limit of a filled bed over the planned critical step: 1.0 to 1.5 in beds of
500 to 8 000 grains, the less the more grains, the more equal and the smoother they are."""


def stage_s(program: Program, stage: Stage) -> float:
    """Simulated time of a stage: exact where it is given, a guess where sand must come to rest."""
    scenario = program.scenario
    if stage.settling is None:
        return stage.duration_s
    if stage.kind is StageKind.SETTLE and stage.vibration is None:
        landed_s = fall_s(scenario, program.counts[stage.layer - 1])
        # sand that may be as fast as it falls is at rest at once
        rests_at_once = scenario.rest.rms_speed_m_s > scenario.gravity_m_s2 * landed_s
        guess = 0.0 if rests_at_once else landed_s + REST_AFTER_FALL_S
    elif stage.kind is StageKind.DISCHARGE:
        guess = _outflow_s(scenario) + REST_AFTER_FLOW_S
    else:
        guess = stage.stop_s + REST_AFTER_MOTION_S
    return min(max(guess, stage.settling.shortest_s), stage.settling.longest_s)


def run_s(program: Program) -> float:
    """Simulated time of a whole run."""
    return sum(stage_s(program, stage) for stage in program.stages)


def shaken_step_s(scenario: Scenario) -> float:
    """Time step after the fill: a guess, where the filled bed is still to give it."""
    if not scenario.takes_step_of_bed or scenario.has_step_of_bed:
        return scenario.step_s
    limit_s = LIMIT_OF_BED * scenario.critical_step.step_s
    return with_bed_step(scenario, max(limit_s, scenario.time_step.step_s or 0.0)).step_s


def stage_steps(program: Program) -> list[float]:
    """Time steps of each stage; those of the fill may have another length."""
    scenario, filled = program.scenario, program.fill_stages
    fill_s = scenario.planned_step_s if scenario.takes_step_of_bed else scenario.step_s
    steps_s = filled * [fill_s] + (len(program.stages) - filled) * [shaken_step_s(scenario)]
    return [stage_s(program, each) / s for each, s in zip(program.stages, steps_s, strict=True)]


def grain_steps(program: Program, first_stage: int = 0) -> float:
    """Sum over stages of grains present times steps, from a stage on."""
    total, grains = 0.0, 0
    for number, (stage, steps) in enumerate(zip(program.stages, stage_steps(program), strict=True)):
        grains += program.counts[stage.layer - 1] if stage.layer else 0
        if number >= first_stage:
            total += grains * steps
    return total


def _outflow_s(scenario: Scenario) -> float:
    """Guess of the time that the sand takes to leave through its gate; infinite if it does not."""
    gate, g, d = scenario.gate, scenario.gravity_m_s2, scenario.dimension
    if gate is None or g == 0.0:
        return math.inf
    width = max(gate.size_m) - EDGE * scenario.sand.mass_median_diameter_m
    if width <= 0.0:
        return math.inf
    return filled_measure(scenario) / (OUTFLOW[d] * math.sqrt(g) * width ** (d - 0.5))


def cost_before(scenario: Scenario) -> Cost:
    """Cost row of a run that has not begun: its engine and its time step."""
    fraction = scenario.step_s / scenario.critical_step.step_s
    return Cost(scenario.engine.name, scenario.engine.ranks, scenario.step_s, fraction)
