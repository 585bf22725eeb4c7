"""What the plan tells of a casting before it is computed: what elements and box make of it."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from functools import lru_cache
from typing import Any

from sandmould.casting.arpm import scene
from sandmould.casting.arpm.estimates import (
    Cooled,
    freezes_s,
    heat_to_lose_j_m3,
    least_sand_share,
    sand_takes_j_m3,
)
from sandmould.kinds.kind import Note
from sandmould.runs.formatting import number
from sandmould.scenario.casting.solidification import Solidification
from sandmould.scenario.checks.wall_thickness import ThinWall, thinnest_wall
from sandmould.scenario.solids import SolidMesh, drawing_notes

FEWEST_ELEMENTS = 2
"""Through a wall: with fewer its inside and its surface are one."""
VOLUME_OFF = 0.01
"""Of the drawn volume, told when elements hold so much more or less."""
LATER = 1.05
"""Times the time in sand without end from which a box is called small."""


def notes(scenario: Solidification) -> Sequence[Note]:
    """Notes of one scenario that has no problems."""
    it = scene.cooled_of(scenario)
    return [*_sand(scenario, it), *_symmetry(scenario), *_walls(scenario), *_volume(scenario),
            *_drawings(scenario), *_front(scenario)]  # fmt: skip


def _sand(scenario: Solidification, it: Cooled) -> Iterator[Note]:
    share = least_sand_share(scenario, it)
    unit = "m2" if scenario.dimensions == 2 else "m3"
    if share >= 1.0:
        least = heat_to_lose_j_m3(scenario) * it.volume_m3 / sand_takes_j_m3(scenario)
        yield Note(
            "never",
            "The casting never freezes in this box, whatever until_s is. Down to its solidus it "
            f"gives {number(share)} times the heat that warms all of the sand to that temperature. "
            f"The box needs more than {number(least)} {unit} of sand; it has {number(it.sand_m3)}.",
        )
        return
    wide_s, here_s = freezes_s(scenario, it), freezes_s(scenario, it, it.sand_depth_m)
    if here_s > LATER * wide_s:
        depth_mm = number(1e3 * it.sand_depth_m)
        yield Note(
            "sand",
            f"There is too little sand: {depth_mm} mm on average, and no heat leaves the box. The "
            f"casting gives {share:.0%} of the heat that this sand can take. It freezes after "
            f"about {number(here_s)} s instead of {number(wide_s)} s; the run may show more.",
        )


def _symmetry(scenario: Solidification) -> Iterator[Note]:
    material = scene.raster_of(scenario).material
    sides = [
        f"{end} {'xyz'[axis]}"
        for axis in range(material.ndim)
        for end, at in (("low", 0), ("high", -1))
        if material.take(at, axis=axis).any()
    ]
    if sides:
        which = "side" if len(sides) == 1 else "sides"
        are = "it is a plane" if len(sides) == 1 else "they are planes"
        yield Note(
            "symmetry",
            f"The casting touches the box at its {which} of {' and '.join(sides)}: {are} of "
            "symmetry, through which no heat passes.",
        )


@lru_cache(maxsize=8)
def _thin_wall(shapes: tuple[Any, ...], below_m: float) -> ThinWall | None:
    bodies = [scene.solid_of(shape, f"shapes.{n}") for n, shape in enumerate(shapes)]
    return thinnest_wall(bodies, below_m)


def _walls(scenario: Solidification) -> Iterator[Note]:
    least_m = FEWEST_ELEMENTS * scenario.element_m
    wall = _thin_wall(scenario.shapes, least_m * (1.0 - 1e-6))
    if wall is None:
        return
    place = ", ".join(number(float(x)) for x in wall.place_m)
    lost = wall.thickness_m < scenario.element_m
    yield Note(
        "walls",
        f"The casting has walls thinner than {FEWEST_ELEMENTS} elements of "
        f"{number(1e3 * scenario.element_m)} mm. The thinnest measures "
        f"{number(1e3 * wall.thickness_m)} mm, at ({place}) m. Such walls have "
        f"{wall.surface_share:.0%} of the surface."
        + (" What is thinner than an element may be missing from the run." if lost else ""),
    )


def _volume(scenario: Solidification) -> Iterator[Note]:
    drawn = sum(abs(solid.measure) for solid in scene.solids_of(scenario))
    held = scene.held_volume_m3(scenario)
    if abs(held / drawn - 1.0) > VOLUME_OFF:
        factor, unit = (1e6, "mm2") if scenario.dimensions == 2 else (1e9, "mm3")
        yield Note(
            "volume",
            f"The elements hold {abs(held / drawn - 1.0):.1%} {'more' if held > drawn else 'less'} "
            f"than the drawn casting: {number(factor * held, 4)} instead of "
            f"{number(factor * drawn, 4)} {unit}.",
        )


def _drawings(scenario: Solidification) -> Iterator[Note]:
    for n, shape in enumerate(scenario.shapes):
        if isinstance(shape, SolidMesh):
            for k, text in enumerate(drawing_notes(shape, f"shapes.{n}")):
                yield Note(f"drawing {n} {k}", text)


def _front(scenario: Solidification) -> Iterator[Note]:
    metal = scenario.casting
    if not scenario.layers or metal.solidus_k < metal.liquidus_k:
        return
    elements = scene.elements_of(scenario)
    largest_m = float(elements.size_m[elements.material == scene.CASTING].max())
    if largest_m > 1.5 * scenario.element_m:
        yield Note(
            "front",
            "The metal melts at one temperature, and layers put elements of "
            f"{number(1e3 * largest_m)} mm into the casting. These freeze as a whole: in a strong "
            "chill some per cent of the casting's time too early. layers = [] leaves none.",
        )
