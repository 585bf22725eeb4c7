"""Spaces too narrow for the grains, where sand jams, and walls too thin to hold them back."""

from __future__ import annotations

import contextlib
import math
from dataclasses import dataclass

import numpy as np

from sandmould.bad_input import BadInputError
from sandmould.geometry.geometry import Revolved
from sandmould.geometry.mesh import TriangleMesh
from sandmould.geometry.outline import Outline
from sandmould.runs.formatting import rounded
from sandmould.scenario.box import Tube
from sandmould.scenario.checks.wall_thickness import ThinWall, thinnest_wall
from sandmould.scenario.pattern import PatternDrawing
from sandmould.scenario.scenario import Scenario
from sandmould.scenario.solids import drawn_surface

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


@dataclass(frozen=True)
class Thin:
    """A solid with a wall thinner than the smallest grain."""

    name: str
    wall: ThinWall
    smallest_m: float
    """Diameter of the smallest grain."""


def thin_walls(scenario: Scenario) -> list[Thin]:
    """Solids through whose thinnest wall grains may pass."""
    smallest_m = scenario.sand.classes(scenario.dimension)[0].diameter_m
    solids: list[Outline | TriangleMesh] = [*scenario.scene.outlines, *scenario.scene.meshes]
    walls = {s.name: thinnest_wall([_as_drawn(scenario, s)], smallest_m) for s in solids}
    return [Thin(name, wall, smallest_m) for name, wall in walls.items() if wall]


def _as_drawn(scenario: Scenario, solid: Outline | TriangleMesh) -> Outline | TriangleMesh:
    """A solid, a drawn pattern by its drawing: its elements cut corners."""
    pattern = scenario.pattern
    if pattern is None or solid.name != pattern.name:
        return solid
    if not isinstance(pattern.shape, PatternDrawing) or pattern.others:
        return solid
    with contextlib.suppress(BadInputError):  # gone or changed since it was planned
        drawn_m, triangles = drawn_surface(pattern.shape, "pattern.shape")
        return TriangleMesh(solid.name, drawn_m + np.array(pattern.position_m), triangles)
    return solid
