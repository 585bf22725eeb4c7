"""A time step that is taken from the filled bed, and when the shaken bed is compared with it."""

from __future__ import annotations

import math

from sandmould.engines.program import Program
from sandmould.engines.step_counts import StepCounts
from sandmould.scenario.scenario import Scenario
from sandmould.scenario.time_step import LEAST_STEPS_A_PERIOD

MOMENTS = 20
"""At which the limit of the shaken bed is found."""
_DIGITS = 4
"""Of the step. The eigenproblem is solved to ten; its last ones may differ between machines."""
_GOLDEN = 0.5 * (math.sqrt(5.0) - 1.0)


def with_bed_step(scenario: Scenario, limit_s: float) -> Scenario:
    """Give a scene the step of its filled bed, for all that follows the fill.

    Parameters
    ----------
    scenario : Scenario
        With ``time_step.bed_fraction``.
    limit_s : float
        Exact limit of the bed; infinite where nothing touches, and the planned step stays.

    Returns
    -------
    Scenario
        The same with that ``time_step.step_s``, rounded down.
    """
    fraction = scenario.time_step.bed_fraction
    assert fraction is not None
    periods_s = (1.0 / stage.frequency_hz for stage in scenario.vibrations)
    longest_s = (period_s / LEAST_STEPS_A_PERIOD for period_s in periods_s)
    step_s = scenario.step_s
    if math.isfinite(limit_s):
        step_s = _rounded_down(min(fraction * limit_s, scenario.rest.check_every_s, *longest_s))
    time_step = scenario.time_step.model_copy(update={"step_s": step_s})
    return scenario.model_copy(update={"time_step": time_step})


def _rounded_down(value: float) -> float:
    power = _DIGITS - 1 - math.floor(math.log10(value))
    return float(f"{math.floor(value * 10.0**power)}e{-power}")


def limit_moments(program: Program) -> list[int]:
    """Moments of the vibration after the fill at which the limit is found.

    One lies in each twentieth of the vibration, at a place that goes round by the golden section:
    at equal distances all might find the box at one phase.

    Returns
    -------
    list of int
        In steps of vibration; rests in between do not count.
    """
    counts = StepCounts.of(program.scenario)
    shaken = [stage.vibration for stage in program.stages if stage.counts_as_vibration]
    steps = sum(counts.vibration(vibration) for vibration in shaken if vibration)
    places = (k + (k + 1) * _GOLDEN % 1.0 for k in range(MOMENTS))
    return [int(steps * place / MOMENTS) for place in places]


def limit_warning(step_s: float, least_s: float | None) -> str:
    """Say that the limit of the shaken bed fell below the step; nothing where it did not."""
    if least_s is None or least_s >= step_s:
        return ""
    return (
        f"the time step {step_s:.4g} s was above the exact limit of the shaken bed, "
        f"{least_s:.4g} s at the least: take a smaller time_step.bed_fraction"
    )
