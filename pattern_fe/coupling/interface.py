"""The coupling interface: the pattern's surface as the obstacle that the sand meets."""

from __future__ import annotations

from sandmould.pattern_fe.coupling.schemes import refuse_scheme
from sandmould.pattern_fe.placing import refuse_place
from sandmould.pattern_fe.scene import pattern_of
from sandmould.scenario.box import Polygon
from sandmould.scenario.scenario import Scenario
from sandmould.scenario.solids import Triangles


def with_surface(scenario: Scenario) -> Scenario:
    """The scenario with its pattern among the obstacles, vertex for vertex.

    Raises
    ------
    BadInputError
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
