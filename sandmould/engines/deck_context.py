"""What the templates of all dialects are given."""

from __future__ import annotations

import math
from typing import Any

from sandmould.engines.bed_deck import step_line
from sandmould.engines.deck import remark
from sandmould.engines.deck_lines import (
    SKIN,
    Lines,
    planned_masses_kg,
    size_classes,
    skin_m,
    vibration_key,
)
from sandmould.engines.program import Program, Stage, StepCounts


def _checks(program: Program) -> dict[str, tuple[int, int]]:
    """Of each stage, the steps to its first check and its largest number of checks."""
    counts = StepCounts.of(program.scenario)
    into_check, checks = 0, {}
    for stage in program.stages:
        first = counts.check - into_check
        longest = stage.longest_steps(counts)
        # A bed comes to rest at a check.
        into_check = (into_check + longest) % counts.check if stage.settling is None else 0
        checks[stage.name] = (first, 1 + max(0, math.ceil((longest - first) / counts.check)))
    return checks


def deck_context(program: Program, lines: Lines, run: str, study: str) -> dict[str, Any]:
    """Names and values for the templates of any dialect; an engine adds its own.

    ``run``, ``study``: names for the deck's first line.
    """
    scenario = program.scenario
    counts = StepCounts.of(scenario)
    classes = size_classes(scenario)
    critical = scenario.critical_step
    checks = _checks(program)

    def first_check(stage: Stage) -> int:
        return checks[stage.name][0]

    def most_checks(stage: Stage) -> int:
        return checks[stage.name][1]

    return {
        "run": remark(run),
        "study": remark(study),
        "scenario": scenario,
        "program": program,
        "stages": program.stages,
        "after_bed": scenario.has_step_of_bed,
        "classes": classes,
        "clip": scenario.contact.no_tension == "total",
        "damping": scenario.background_damping,
        "gate": "" if scenario.discharge is None else scenario.discharge.gate,
        "critical": critical,
        "step_s": counts.step_s,
        "step_line": step_line(lines),
        "step_fraction": counts.step_s / critical.step_s,
        "skin": skin_m(scenario),
        "skin_source": f"{SKIN:g} of the mean diameter",
        "obstacle_top": scenario.pouring_top_m,
        "down": "0 -1 0" if scenario.dimension == 2 else "0 0 -1",
        "check_steps": counts.check,
        "setup_steps": counts.setup,
        "first_check": first_check,
        "most_checks": most_checks,
        "load_steps": counts.load,
        "rest_loads": scenario.rest.load_tolerance is not None and scenario.gravity_m_s2 > 0.0,
        "snapshot_steps": counts.records(scenario.record.snapshot_every_s),
        "steps": counts.steps,
        "stage_steps": lambda stage: stage.longest_steps(counts),
        "vibration_key": lambda stage: vibration_key(program, stage),
        "direction": lambda v: v.unit_direction(scenario.dimension),
        "planned_mass": planned_masses_kg(program, classes),
        "source": lines.source,
        "number": lines.number,
        "value": lines.value,
    }
