"""What the plan tells of a casting before it is computed: what elements and box make of it."""

from __future__ import annotations

from functools import lru_cache
from typing import Any

import numpy as np

from sandmould.casting.arpm import scene
from sandmould.casting.arpm.estimates import (
    Cooled,
    freezes_s,
    heat_to_lose_j_m3,
    least_sand_share,
    sand_takes_j_m3,
)
from sandmould.runs import templates
from sandmould.runs.templates import Note
from sandmould.scenario.casting.solidification import Solidification
from sandmould.scenario.checks.wall_thickness import ThinWall, thinnest_wall
from sandmould.scenario.solids import SolidMesh, drawn_part

FEWEST_ELEMENTS = 2
"""Through a wall: with fewer its inside and its surface are one."""
VOLUME_OFF = 0.01
"""Of the drawn volume, told when elements hold so much more or less."""
MOVED = 0.25
"""Of an element, told when the casting's elements end farther from its drawing."""
LATER = 1.05
"""Times the time in sand without end from which a box is called small."""


def notes(scenario: Solidification) -> tuple[Note, ...]:
    """Notes of one scenario that has no problems."""
    it = scene.cooled_of(scenario)
    share = least_sand_share(scenario, it)
    drawn, held = scene.drawn_volume_m3(scenario), scene.held_volume_m3(scenario)
    return templates.notes(
        "plan_solidification.j2",
        scenario=scenario,
        it=it,
        until_s=scenario.until_s,
        share=share,
        least_sand_m3=heat_to_lose_j_m3(scenario) * it.volume_m3 / sand_takes_j_m3(scenario),
        times_s=_times_s(scenario, it) if share < 1.0 else None,
        sides=_sides(scenario),
        box_m=_box_m(scenario),
        moved=_moved(scenario),
        as_drawn=scenario.exchange not in scene.KERNEL_FORMS,
        fewest=FEWEST_ELEMENTS,
        wall=_thin_wall(scenario.shapes, FEWEST_ELEMENTS * scenario.element_m * (1.0 - 1e-6)),
        drawn=drawn,
        held=held if abs(held / drawn - 1.0) > VOLUME_OFF else drawn,
        drawings={
            f"shapes.{n}": drawn_part(shape, np.subtract(scenario.box.high_m, scenario.box.low_m))
            for n, shape in enumerate(scenario.shapes)
            if isinstance(shape, SolidMesh)
        },
        largest_m=_largest_m(scenario),
    )


def _times_s(scenario: Solidification, it: Cooled) -> tuple[float, float] | None:
    """Times to freeze in this box and in sand without end, where they differ."""
    wide_s, here_s = freezes_s(scenario, it), freezes_s(scenario, it, it.sand_depth_m)
    return (here_s, wide_s) if here_s > LATER * wide_s else None


def _sides(scenario: Solidification) -> list[str]:
    """Sides of the box that the casting touches."""
    casting = scene.raster_of(scenario).material == scene.CASTING
    return [
        f"{end} {'xyz'[axis]}"
        for axis in range(casting.ndim)
        for end, at in (("low", 0), ("high", -1))
        if casting.take(at, axis=axis).any()
    ]


def _box_m(scenario: Solidification) -> list[float] | None:
    """Sides of the box as whole elements fill it; None where they are those that were given."""
    elements, given_m = (
        scene.elements_of(scenario),
        np.subtract(scenario.box.high_m, scenario.box.low_m),
    )
    sides = scenario.air.sides if scenario.air else ()
    layers = [sum(side.endswith(axis) for side in sides) for axis in "xyz"[: len(given_m)]]
    box_m = elements.high_m - elements.low_m - scenario.element_m * np.array(layers)
    return None if np.allclose(box_m, given_m, rtol=1e-9) else box_m.tolist()


def _moved(scenario: Solidification) -> dict[str, tuple[Any, Any]]:
    """Ends (m) of the casting's elements and of its drawing, by axis, where they lie apart."""
    raster = scene.raster_of(scenario)
    corners = np.concatenate([solid.corners() for solid in scene.solids_of(scenario)])
    cells = np.argwhere(raster.material == scene.CASTING)
    held = raster.low_m + raster.cell_m * np.array([cells.min(axis=0), cells.max(axis=0) + 1])
    drawn = np.array([corners.min(axis=0), corners.max(axis=0)])
    off = (np.abs(held - drawn) / raster.cell_m).max(axis=0)
    apart = (off > MOVED + 1e-6) & (off < 0.5 + 1e-6)  # beyond, a tip or a thin wall is missing
    ends = np.stack([held, drawn]).round(9) + 0.0
    return {"xyz"[k]: (ends[0, :, k], ends[1, :, k]) for k in np.flatnonzero(apart)}


@lru_cache(maxsize=8)
def _thin_wall(shapes: tuple[Any, ...], below_m: float) -> ThinWall | None:
    bodies = [scene.solid_of(shape, f"shapes.{n}") for n, shape in enumerate(shapes)]
    return thinnest_wall(bodies, below_m)


def _largest_m(scenario: Solidification) -> float:
    """Largest element in a metal that melts at one temperature; 0 where layers leave none."""
    metal = scenario.casting
    if not scenario.layers or metal.solidus_k < metal.liquidus_k:
        return 0.0
    elements = scene.elements_of(scenario)
    largest_m = float(elements.size_m[elements.material == scene.CASTING].max())
    return largest_m if largest_m > 1.5 * scenario.element_m else 0.0
