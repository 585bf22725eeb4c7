"""What the plan tells of a scene of sand before it is computed."""

from __future__ import annotations

from sandmould.engines import registry
from sandmould.geometry.mesh import TriangleMesh
from sandmould.geometry.outline import Outline
from sandmould.kernel_cache import are_compiled
from sandmould.kinds.sand.narrow import narrow_spaces
from sandmould.runs import templates
from sandmould.runs.templates import Note
from sandmould.scenario.checks.wall_thickness import thinnest_wall
from sandmould.scenario.hardness import LEAST_KAPPA, bed_hardness
from sandmould.scenario.pattern import PatternDrawing
from sandmould.scenario.scenario import Scenario
from sandmould.scenario.solids import SolidMesh, drawing_notes

HIGH_ACCELERATION_G = 20.0
"""Peak acceleration above which a plan asks whether the amplitude is meant so."""
COMPILE_S = 55.0
"""Processor time for what a first run compiles in lanes: 58 s measured in 2D, 50 s in 3D (an AMD
EPYC with AVX2, idle)."""


def notes(scenario: Scenario) -> tuple[Note, ...]:
    """How stiff the grains are, spaces and walls thinner than they allow, and drawings."""
    smallest_m = scenario.sand.classes(scenario.dimension)[0].diameter_m
    solids: list[Outline | TriangleMesh] = [*scenario.scene.outlines, *scenario.scene.meshes]
    walls = {solid.name: thinnest_wall([solid], smallest_m) for solid in solids}
    drawn = {f"obstacles.{n}": it for n, it in enumerate(scenario.obstacles)
             if isinstance(it, SolidMesh)}  # fmt: skip
    return templates.notes(
        "plan_sand.j2",
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
        walls={name: wall for name, wall in walls.items() if wall},
        smallest_m=smallest_m,
        drawings={key: drawing_notes(it, key) for key, it in drawn.items()},
        pattern=_pattern_notes(scenario),
    )


def _pattern_notes(scenario: Scenario) -> list[str]:
    """What was repaired in the drawing of a pattern, and how good its mesh is."""
    if scenario.pattern is None or not isinstance(scenario.pattern.shape, PatternDrawing):
        return []
    from sandmould.pattern_fe.quality import mesh_sentence
    from sandmould.pattern_fe.scene import pattern_of

    return [
        *drawing_notes(scenario.pattern.shape, "pattern.shape"),
        mesh_sentence(scenario, pattern_of(scenario)),
    ]
