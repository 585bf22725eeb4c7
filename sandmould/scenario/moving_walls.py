"""Walls and plates that move by themselves, which not every engine can."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

from sandmould.bad_input import Problem
from sandmould.scenario.box import piston_wall
from sandmould.scenario.scenario import Scenario


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
