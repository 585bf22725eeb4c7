"""What keeps a table with an unbalance or walls that move from being computed in a scene."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

from sandmould.bad_input import Problem
from sandmould.scenario.box import piston_wall
from sandmould.scenario.placement import filled_measure
from sandmould.scenario.scenario import Scenario
from sandmould.scenario.unbalance import Unbalance
from sandmould.scenario.vibration import VibrationStage

LEAST_MASS_SHARE = 0.1
"""Of the sand's mass that a table must have. The time step is chosen for grains against a wall that
does not give way. A table as heavy as the layer of grains that touches it halves the square of the
critical step at worst, and a bed has more than ten layers."""
_LAID_DOWN = "acceleration, velocity or displacement"


def _unbalances(s: Scenario) -> Iterator[tuple[str, Unbalance]]:
    """Keys of the stages after the fill that have an unbalance, with it."""
    for number, stage in enumerate(s.vibration):
        if isinstance(stage, VibrationStage) and stage.unbalance is not None:
            yield f"vibration.{number}", stage.unbalance


def unbalance_key(s: Scenario) -> str | None:
    """Key of the first stage with an unbalance, None where the box moves as laid down."""
    return next((key for key, _ in _unbalances(s)), None)


def unbalance_problems(s: Scenario) -> Iterator[Problem]:
    """Stages with an unbalance that do not go with the rest of a scene."""
    between, pouring = s.fill.vibration_between_layers, s.fill.vibration
    if between is not None and between.unbalance is not None:
        valid = f"{_LAID_DOWN} between layers: the table stands while it is filled"
        yield Problem("fill.vibration_between_layers.hold", "unbalance", valid)
    if pouring is not None and pouring.unbalance is not None:
        valid = f"{_LAID_DOWN} while layers are poured: a table on mounts is not filled"
        yield Problem("fill.vibration.hold", "unbalance", valid)
    for key, unbalance in _unbalances(s):
        depth_m = unbalance.flask_depth_m
        if s.dimension == 2 and depth_m is None:
            valid = (
                "the flask's depth across the plane in m. In 2D the discs are only as thick as "
                "sand.disc_thickness_m, and the table carries the sand of the whole flask"
            )
            yield Problem(f"{key}.unbalance.flask_depth_m", None, valid)
        elif s.dimension == 3 and depth_m is not None:
            valid = "absent in 3D, where box.depth_m is the flask's depth"
            yield Problem(f"{key}.unbalance.flask_depth_m", depth_m, valid)
        if s.pattern is not None:
            yield Problem(f"{key}.hold", "unbalance", f"{_LAID_DOWN} in a scene with a pattern")
    holds = {stage.hold for stage in s.vibrations}
    if "unbalance" in holds and len(holds) > 1:
        for number, stage in enumerate(s.vibration):
            if isinstance(stage, VibrationStage) and stage.hold != "unbalance":
                valid = "unbalance in every stage of vibration, or in none"
                yield Problem(f"vibration.{number}.hold", stage.hold, valid)


def table_mass_problem(s: Scenario) -> Iterator[Problem]:
    """Tables so light that the grains on them would need a shorter time step."""
    for key, unbalance in _unbalances(s):
        sand_kg = s.sand.density_kg_m3 * filled_measure(s) * (unbalance.flask_depth_m or 1.0)
        least_kg = LEAST_MASS_SHARE * sand_kg
        if unbalance.moving_mass_kg < least_kg:
            valid = (
                f"at least {least_kg:.4g} kg, a tenth of the mass of the sand in the flask. The "
                "time step does not resolve a lighter table"
            )
            yield Problem(f"{key}.unbalance.moving_mass_kg", unbalance.moving_mass_kg, valid)


def piston_problems(s: Scenario) -> Iterator[Problem]:
    """A piston that leaves too little of the box, or meets what stands in it."""
    piston = s.piston
    if piston is None:
        return
    if piston.axis == 1 and s.dimension == 2:
        yield Problem("piston.wall", piston.wall, "top, floor, left or right in 2D")
        return
    room_m = s.box.size_m(s.dimension)[piston.axis] - 3 * s.largest_diameter_m
    if piston.way_m > room_m:
        valid = f"a time in which it goes {room_m:.4g} m at most: three of the largest grains stay"
        yield Problem("piston.duration_s", piston.duration_s, valid)
    wall = piston_wall(piston, s.box, s.dimension, max(0.0, piston.way_m))
    for solid in s.scene.solids:
        if wall.distance_m(solid.corners()).min() < -1e-9:
            valid = f"a piston that stops before {solid.name}"
            yield Problem("piston.duration_s", piston.duration_s, valid)


def moving_wall(s: Scenario) -> tuple[str, Any] | None:
    """Key and value of what moves a wall or a plate against the box; None where all stand."""
    if s.discharge is not None and s.discharge.opening_time_s is not None:
        return "discharge.opening_time_s", s.discharge.opening_time_s
    if s.piston is not None:
        return "piston.velocity_m_s", s.piston.velocity_m_s
    return None
