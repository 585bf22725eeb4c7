"""What the plan tells of a scene of sand before it is computed."""

from __future__ import annotations

from typing import Any

import numpy as np

from sandmould.engines import registry
from sandmould.kernel_cache import are_compiled
from sandmould.kinds.sand.narrow import narrow_spaces, thin_walls
from sandmould.runs import templates
from sandmould.runs.templates import Note
from sandmould.scenario.cavities import MeshCavity
from sandmould.scenario.hardness import LEAST_KAPPA, bed_hardness
from sandmould.scenario.pattern import PatternDrawing
from sandmould.scenario.scenario import Scenario
from sandmould.scenario.solids import SolidMesh, drawn_part, drawn_surface

HIGH_ACCELERATION_G = 20.0
"""Peak acceleration above which a plan asks whether the amplitude is meant so."""
COMPILE_S = 55.0
"""Processor time for what a first run compiles in lanes: 58 s measured in 2D, 50 s in 3D (an AMD
EPYC with AVX2, idle)."""


def notes(scenario: Scenario) -> tuple[Note, ...]:
    """How stiff the grains are, spaces and walls thinner than they allow, and drawings."""
    box_m = np.array(scenario.box.size_m(scenario.dimension))
    places = {"obstacles": scenario.obstacles, "cavities": scenario.cavities}
    drawn = {
        f"{key}.{n}": drawn_part(it, box_m)
        for key, solids in places.items()
        for n, it in enumerate(solids)
        if isinstance(it, SolidMesh) and not getattr(it, "hollow", None)
    }
    return templates.notes(
        "plan_sand.j2",
        grains_m=[each.diameter_m for each in scenario.sand.classes(scenario.dimension)],
        scale=scenario.sand.size_scale,
        hardness=bed_hardness(scenario),
        least=LEAST_KAPPA,
        narrow=narrow_spaces(scenario),
        compiles=registry.calls_our_kernels(scenario) and not are_compiled("dem"),
        compile_s=COMPILE_S,
        beyond_reason=[
            stage
            for stage in scenario.vibrations
            if stage.unbalance is None and stage.peak_acceleration_g > HIGH_ACCELERATION_G
        ],
        walls=thin_walls(scenario),
        drawings=drawn,
        hollows={
            f"cavities.{n}": scenario.scene.cavities[n].space
            for n, it in enumerate(scenario.cavities)
            if isinstance(it, MeshCavity) and it.hollow
        },
        edges=scenario.engine.name == "liggghts" and bool(scenario.scene.meshes),
        **_of_pattern(scenario),
    )


def _of_pattern(scenario: Scenario) -> dict[str, Any]:
    """What a drawn pattern measures, and how good its mesh is."""
    if scenario.pattern is None or not isinstance(scenario.pattern.shape, PatternDrawing):
        return {"pattern": None}
    from sandmould.pattern_fe.nearest import nearest_on_facets
    from sandmould.pattern_fe.quality import mesh_sentence
    from sandmould.pattern_fe.scene import pattern_of

    pattern = pattern_of(scenario)
    drawn_m, _ = drawn_surface(scenario.pattern.shape, "pattern.shape")
    drawn_m = drawn_m + np.array(scenario.pattern.position_m)
    _, _, place_m = nearest_on_facets(drawn_m, pattern.surface.vertices_m[pattern.surface.facets])
    return {
        "pattern": drawn_part(scenario.pattern.shape, np.array(scenario.box.size_m(3))),
        "pattern_mesh": mesh_sentence(scenario, pattern),
        "off_mm": 1e3 * float(np.linalg.norm(place_m - drawn_m, axis=1).max()),
    }
