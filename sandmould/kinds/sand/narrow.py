"""Spaces that are too narrow for the grains: sand jams in them whatever the table does."""

from __future__ import annotations

import math
from dataclasses import dataclass

from sandmould.geometry.geometry import Revolved
from sandmould.runs.formatting import rounded
from sandmould.scenario.box import Tube
from sandmould.scenario.checks.wall_thickness import thinnest_wall
from sandmould.scenario.scenario import Scenario

LEAST_GRAINS = 5.0
"""Of the largest diameter: in narrower spaces a few grains form an arch and stop the others."""


@dataclass(frozen=True)
class Narrow:
    """Tubes and cavities of one width that are narrow for the grains."""

    names: list[str]
    width_m: float
    largest_m: float
    """Diameter of the largest grain."""
    scale: float
    """Largest ``sand.size_scale`` with which it is wide enough, down to a tenth."""
    least = LEAST_GRAINS

    @property
    def in_grains(self) -> float:
        """Largest grains side by side."""
        return self.width_m / self.largest_m


def narrow_spaces(scenario: Scenario) -> list[Narrow]:
    """Tubes and cavities that are narrow for the grains, those of one width together."""
    largest_m = scenario.sand.classes(scenario.dimension)[-1].diameter_m
    limit_m = LEAST_GRAINS * largest_m
    widths_m = {o.name: o.diameter_m for o in scenario.obstacles if isinstance(o, Tube)}
    for cavity in scenario.scene.cavities:
        if isinstance(cavity.space, Revolved):
            continue
        wall = thinnest_wall([cavity.space], limit_m)
        if wall is not None:
            widths_m[cavity.name] = wall.thickness_m
    alike: dict[float, list[str]] = {}
    for name, width_m in widths_m.items():
        if width_m < limit_m:
            alike.setdefault(rounded(width_m), []).append(name.replace("_", " "))
    scale = scenario.sand.size_scale / limit_m
    return [
        Narrow(names, width_m, largest_m, math.floor(10 * scale * width_m) / 10)
        for width_m, names in alike.items()
    ]
