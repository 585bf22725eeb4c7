"""What the plan tells of a scene of sand before it is computed."""

from __future__ import annotations

from sandmould.engines import registry
from sandmould.geometry.mesh import TriangleMesh
from sandmould.geometry.outline import Outline
from sandmould.kernel_cache import are_compiled
from sandmould.kinds.kind import Note
from sandmould.kinds.sand.hardness_text import hardness_lines
from sandmould.kinds.sand.narrow import narrow_spaces
from sandmould.runs.formatting import number
from sandmould.scenario.checks.wall_thickness import thinnest_wall
from sandmould.scenario.hardness import bed_hardness
from sandmould.scenario.pattern import PatternDrawing
from sandmould.scenario.scenario import Scenario
from sandmould.scenario.solids import SolidMesh, drawing_notes

HIGH_ACCELERATION_G = 20.0
"""Peak acceleration above which a plan asks whether the amplitude is meant so."""
COMPILE_S = 25.0
"""Processor time for what a first run compiles: 24 s measured in 2D, 26 s in 3D, 24 s with a
pattern (fe_column)."""


def notes(scenario: Scenario) -> list[Note]:
    """How hard the bed is, obstacles thinner than a grain, and shells that were no cavities."""
    smallest_m = scenario.sand.classes(scenario.dimension)[0].diameter_m
    hardness = bed_hardness(scenario)
    told = [Note(head, text, head) for head, text in hardness_lines(hardness)] if hardness else []
    told += [Note(f"width of {name}", text) for name, text in narrow_spaces(scenario).items()]
    if registry.calls_our_kernels(scenario) and not are_compiled("dem"):
        text = (
            "Sandmould's own code is not compiled on this machine yet. The first start compiles "
            f"it: about {COMPILE_S:g} s of a core more, once."
        )
        told.append(Note("compiling", text))
    told += _drive_notes(scenario)
    solids: list[Outline | TriangleMesh] = [*scenario.scene.outlines, *scenario.scene.meshes]
    for solid in solids:
        wall = thinnest_wall([solid], smallest_m)
        if wall is not None:
            place = ", ".join(number(float(x)) for x in wall.place_m)
            text = (
                f"{solid.name} has walls thinner than the smallest grain of "
                f"{number(1e3 * smallest_m)} mm. The thinnest measures "
                f"{number(1e3 * wall.thickness_m)} mm, at ({place}) m. A grain that is pressed in "
                "by half of that comes out on the other side."
            )
            told.append(Note(f"walls of {solid.name}", text))
    for i, obstacle in enumerate(scenario.obstacles):
        if isinstance(obstacle, SolidMesh):
            key = f"obstacles.{i}"
            told += [
                Note(f"drawing {key} {n}", text)
                for n, text in enumerate(drawing_notes(obstacle, key))
            ]
    return [*told, *_pattern_notes(scenario)]


def _drive_notes(scenario: Scenario) -> list[Note]:
    """Accelerations that are hardly meant, such as after a slip in a unit."""
    return [
        Note(
            f"acceleration {n}",
            f"The box shakes at up to {number(stage.peak_acceleration_g)} g at "
            f"{number(stage.frequency_hz)} Hz: check the amplitude and its unit.",
        )
        for n, stage in enumerate(scenario.vibrations)
        if stage.unbalance is None and stage.peak_acceleration_g > HIGH_ACCELERATION_G
    ]


def _pattern_notes(scenario: Scenario) -> list[Note]:
    """What was repaired in the drawing of a pattern, and how good its mesh is."""
    if scenario.pattern is None or not isinstance(scenario.pattern.shape, PatternDrawing):
        return []
    from sandmould.pattern_fe.quality import mesh_sentence
    from sandmould.pattern_fe.scene import pattern_of

    said = [
        *drawing_notes(scenario.pattern.shape, "pattern.shape"),
        mesh_sentence(scenario, pattern_of(scenario)),
    ]
    return [Note(f"mesh of the pattern {n}", text) for n, text in enumerate(said)]
