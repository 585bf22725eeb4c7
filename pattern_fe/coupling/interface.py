"""The coupling interface: the pattern's surface as the obstacle that the sand meets.

What keeps a pattern from standing where a scenario puts it is said in one sentence each.
"""

from __future__ import annotations

import numpy as np

from sandmould.bad_input import BadInputError, Problem
from sandmould.geometry.geometry import Scene
from sandmould.geometry.mesh import TriangleMesh
from sandmould.pattern_fe.coupling.schemes import refuse_scheme
from sandmould.pattern_fe.pattern import Pattern
from sandmould.pattern_fe.scene import pattern_of, surroundings_of
from sandmould.scenario.box import Polygon
from sandmould.scenario.checks.scene import problems
from sandmould.scenario.pattern import MeshFile
from sandmould.scenario.scenario import Scenario
from sandmould.scenario.solids import Triangles


def with_surface(scenario: Scenario) -> Scenario:
    """The scenario with its pattern among the obstacles, vertex for vertex.

    Raises BadInputError.
    """
    config = scenario.pattern
    if config is None:
        return scenario
    pattern = pattern_of(scenario)
    refuse_place(scenario, pattern)
    refuse_scheme(scenario, pattern)
    outer = pattern.surface.outer
    vertices_m = [tuple(v) for v in outer.vertices_m.tolist()]
    solid: Polygon | Triangles
    if scenario.dimension == 2:
        solid = Polygon(kind="polygon", name=config.name, vertices_m=vertices_m)
    else:
        triangles = [tuple(t) for t in outer.facets.tolist()]
        solid = Triangles(
            kind="triangles", name=config.name, vertices_m=vertices_m, triangles=triangles
        )
    others = tuple(o for o in scenario.obstacles if o.name != config.name)
    return scenario.model_copy(update={"obstacles": (*others, solid)})


def refuse_place(scenario: Scenario, pattern: Pattern) -> None:
    """Refuse a pattern that is smaller than a grain, or in the place of an obstacle.

    Raises
    ------
    BadInputError
        Also where obstacles are not sound themselves.
    """
    config = scenario.pattern
    assert config is not None
    size_m = np.ptp(pattern.surface.vertices_m, axis=0)
    if size_m.max() < scenario.largest_diameter_m:
        shape = config.shape
        sides = " by ".join(f"{side:.3g}" for side in size_m)
        valid = (
            f"one that makes the pattern larger than the largest grain, "
            f"{scenario.largest_diameter_m:.3g} m; it is {sides} m"
        )
        if isinstance(shape, MeshFile):
            raise BadInputError([Problem("pattern.shape.unit_m", shape.unit_m, valid)])
        raise BadInputError([Problem("pattern.shape", shape.model_dump(mode="json"), valid)])
    _refuse_overlap(scenario)
    unsound = [p for p in problems(scenario) if p.key.startswith("obstacles")]
    if unsound:
        raise BadInputError(unsound)
    name = surroundings_of(scenario, pattern).overlapped_by()
    if name is not None:
        valid = f"a place clear of the obstacle '{name}', which now reaches into the pattern"
        raise BadInputError([Problem("pattern.position_m", list(config.position_m), valid)])


def _refuse_overlap(scenario: Scenario) -> None:
    """Refuse a cluster of which two patterns share space."""
    assert scenario.pattern is not None
    met: list[TriangleMesh] = []
    bodies = scenario.pattern.bodies
    for number, body in enumerate(bodies if len(bodies) > 1 else ()):
        pattern = pattern_of(scenario.model_copy(update={"pattern": body}))
        outer = pattern.surface.outer
        name = pattern.surrounded(Scene(3, (), (), (), meshes=tuple(met))).overlapped_by()
        if name is not None:
            valid = f"a place clear of {name}, which now reaches into this pattern"
            key = f"pattern.others.{number - 1}.position_m"
            raise BadInputError([Problem(key, list(body.position_m), valid)])
        own = f"pattern.others.{number - 1}" if number else "the first pattern"
        met.append(TriangleMesh(own, outer.vertices_m, outer.facets))
