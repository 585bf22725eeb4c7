"""A time step that is taken from the filled bed, and when the shaken bed is compared with it."""

from __future__ import annotations

import math

from sandmould.engines.program import Program, StepCounts
from sandmould.engines.session import EngineStop
from sandmould.runs.outcome import Outcome
from sandmould.runs.products import Cost
from sandmould.scenario.scenario import Scenario
from sandmould.scenario.time_step import LEAST_STEPS_A_PERIOD

MOMENTS = 20
"""At which the limit of the shaken bed is found."""
MOST_AGAIN = 3
"""Times that a run begins again from its fill, since the shaken bed is too stiff for its step."""
_DIGITS = 4
"""Of the step. The eigenproblem is solved to ten; its last ones may differ between machines."""
_GOLDEN = 0.5 * (math.sqrt(5.0) - 1.0)


def with_bed_step(scenario: Scenario, limit_s: float) -> Scenario:
    """Give a scene the step of its filled bed, for all that follows the fill.

    The same with that ``time_step.step_s``, rounded down. One of the user's own stays, and gets its
    ``bed_fraction``. ``scenario``: that takes it, not had it before. ``limit_s``: exact limit of
    the bed; infinite where nothing touches, and the planned step stays.

    Raises
    ------
    EngineStop
        Where the user's own is above the limit.
    """
    fraction, own_s = scenario.time_step.bed_fraction, scenario.time_step.step_s
    if not fraction:
        assert own_s is not None
        if own_s > limit_s:
            valid = f"at most the exact limit of the filled bed, {limit_s:.4g} s"
            said = f"time_step.step_s = {own_s:g} cannot be used: valid is {valid}"
            raise EngineStop(Outcome.BAD_INPUT, said)
        return _with(scenario, step_s=own_s, bed_fraction=own_s / limit_s)
    periods_s = (1.0 / stage.frequency_hz for stage in scenario.vibrations)
    longest_s = (period_s / LEAST_STEPS_A_PERIOD for period_s in periods_s)
    step_s = scenario.step_s
    if math.isfinite(limit_s):
        step_s = _rounded_down(min(fraction * limit_s, scenario.rest.check_every_s, *longest_s))
    return _with(scenario, step_s=step_s)


def _with(scenario: Scenario, **time_step: float) -> Scenario:
    changed = scenario.time_step.model_copy(update=time_step)
    return scenario.model_copy(update={"time_step": changed})


def _rounded_down(value: float) -> float:
    power = _DIGITS - 1 - math.floor(math.log10(value))
    return float(f"{math.floor(value * 10.0**power)}e{-power}")


def limit_moments(program: Program) -> list[int]:
    """Moments of the vibration after the fill at which the limit is found.

    One lies in each twentieth of the vibration, at a place that goes round by the golden section:
    at equal distances all might find the box at one phase.

    In steps of vibration; rests in between do not count.
    """
    counts = StepCounts.of(program.scenario)
    shaken = [stage.vibration for stage in program.stages if stage.counts_as_vibration]
    steps = sum(counts.vibration(vibration) for vibration in shaken if vibration)
    places = (k + (k + 1) * _GOLDEN % 1.0 for k in range(MOMENTS))
    return [int(steps * place / MOMENTS) for place in places]


def limit_notes(cost: Cost) -> list[str]:
    """Say that the limit of the shaken bed fell below the step, and what came of it."""
    notes, least_s = [], cost.least_limit_s
    if cost.begun_again:
        times = "once" if cost.begun_again == 1 else f"{cost.begun_again} times"
        notes.append(
            f"the run began again from its fill {times}, since the exact limit of the shaken bed "
            f"fell below its time step, to {cost.bed_limit_s:.4g} s"
        )
    if least_s is not None and least_s < cost.time_step_s:
        notes.append(
            f"the time step {cost.time_step_s:.4g} s was above the exact limit of the shaken bed, "
            f"{least_s:.4g} s at the least: take a smaller time_step.bed_fraction"
        )
    return notes
