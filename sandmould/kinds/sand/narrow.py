"""Spaces that are too narrow for the grains: sand jams in them whatever the table does."""

from __future__ import annotations

from sandmould.geometry.geometry import Revolved
from sandmould.runs.formatting import listed, number
from sandmould.scenario.box import Tube
from sandmould.scenario.checks.wall_thickness import thinnest_wall
from sandmould.scenario.scenario import Scenario

LEAST_GRAINS = 5.0
"""Of the largest diameter: in narrower spaces a few grains form an arch and stop the others."""


def narrow_spaces(scenario: Scenario) -> dict[str, str]:
    """What to know of tubes and cavities that are narrow for the grains, by their names."""
    largest_m = scenario.sand.classes(scenario.dimension)[-1].diameter_m
    limit_m = LEAST_GRAINS * largest_m
    widths_m = {o.name: o.diameter_m for o in scenario.obstacles if isinstance(o, Tube)}
    for cavity in scenario.scene.cavities:
        if isinstance(cavity.space, Revolved):
            continue
        wall = thinnest_wall([cavity.space], limit_m)
        if wall is not None:
            widths_m[cavity.name] = wall.thickness_m
    way_out = " Smaller grains (sand.size_scale) tell more." if scenario.sand.size_scale > 1 else ""
    alike: dict[str, list[str]] = {}
    for name, width_m in widths_m.items():
        if width_m < limit_m:
            size = f"{number(1e3 * width_m)} mm: {number(width_m / largest_m, 2)} times"
            alike.setdefault(size, []).append(name.replace("_", " "))
    return {
        listed(names): (
            f"{listed(names)} {'is' if len(names) == 1 else 'are'} as narrow as {size} the largest "
            f"grain ({number(1e3 * largest_m)} mm). Below {LEAST_GRAINS:g} times the grains can "
            f"jam.{way_out}"
        )
        for size, names in alike.items()
    }
