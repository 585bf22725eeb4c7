"""What a run of grains costs before it has begun."""

from __future__ import annotations

from sandmould.runs.products import Cost
from sandmould.scenario.scenario import Scenario


def cost_before(scenario: Scenario) -> Cost:
    """Cost row of a run that has not begun: its engine and its time step."""
    fraction = scenario.step_s / scenario.critical_step.step_s
    return Cost(scenario.engine.name, scenario.engine.ranks, scenario.step_s, fraction)
