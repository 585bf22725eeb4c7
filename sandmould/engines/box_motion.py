"""Where the moving box is, in a computation in the laboratory frame."""

from __future__ import annotations

import numpy as np

from sandmould.engines.program import Stage
from sandmould.geometry.geometry import Array
from sandmould.scenario.scenario import Scenario


def displacements(stage: Stage, first: int, count: int, step_s: float) -> Array:
    """Displacement of the box along its direction at some steps of a stage, (count,) float64, m.

    ``first``: first step, counted from the stage's beginning.

    The motion starts one step into the stage, as in the decks.
    """
    if stage.vibration is None:
        return np.zeros(count)
    steps = np.arange(first, first + count) + stage.vibration_steps
    times: Array = (steps - 1) * np.float64(step_s)
    return stage.vibration.displacements_at(times, stage.stops_smoothly)


def start_of_grains(
    scenario: Scenario, stage: Stage, steps: int, step_s: float
) -> tuple[Array, Array]:
    """Where and how fast grains begin that stand still while the box vibrates.

    Returns
    -------
    shift_m : (d,) float64, m
        From their place in the box to that in the frame of the computation.
    velocity_m_s : (d,) float64, m/s
        In the frame of the computation, half a step ago.
    """
    zero = np.zeros(scenario.dimension)
    if stage.vibration is None:
        return zero, zero
    direction = np.array(stage.vibration.unit_direction(scenario.dimension))
    before, now = displacements(stage, steps - 1, 2, step_s)
    if scenario.frame == "box":
        return zero, -(now - before) / step_s * direction
    return now * direction, zero


def box_motion(scenario: Scenario, stage: Stage, steps: int, step_s: float) -> tuple[Array, Array]:
    """Displacement (d,) in m and velocity (d,) in m/s of the walls, zero in the box frame.

    ``steps``: since the stage began.

    Notes
    -----
    The motion starts one step into the stage, as in the decks; the velocity is that of the
    discrete motion, half a step to either side.
    """
    d = scenario.dimension
    vibration = stage.vibration
    if scenario.frame == "box" or vibration is None:
        return np.zeros(d), np.zeros(d)
    direction = np.array(vibration.unit_direction(d))
    before, now, after = displacements(stage, steps - 1, 3, step_s)
    return now * direction, (after - before) / (2 * step_s) * direction
