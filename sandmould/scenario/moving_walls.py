"""Walls and plates that move by themselves, which not every engine can."""

from __future__ import annotations

from typing import Any

from sandmould.scenario.scenario import Scenario


def moving_wall(s: Scenario) -> tuple[str, Any] | None:
    """Key and value of what moves a wall or a plate against the box; None where all stand."""
    if s.discharge is not None and s.discharge.opening_time_s is not None:
        return "discharge.opening_time_s", s.discharge.opening_time_s
    return None
