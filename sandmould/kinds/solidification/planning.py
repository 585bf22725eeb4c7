"""How a solidification is planned: a casting in its mould, by particles of several sizes."""

from __future__ import annotations

import math
import time
from collections.abc import Iterator, Mapping
from functools import lru_cache
from pathlib import Path
from typing import Any

import numpy as np

from sandmould.bad_input import Problem
from sandmould.casting.arpm import computation, scene, source_hash
from sandmould.casting.arpm.elements import placed
from sandmould.casting.arpm.estimates import (
    Cooled,
    freezes_s,
    heat_to_lose_j_m3,
    least_sand_share,
    sand_takes_j_m3,
)
from sandmould.kinds.casting import CastingPlanning
from sandmould.kinds.kind import BASE_MEMORY_MB, SpeedClass, StoredSpeed
from sandmould.limits import CELLS, RECORDS
from sandmould.runs.measures import once, read_groups
from sandmould.runs.templates import Note, notes
from sandmould.scenario.casting.shapes import with_file_hash
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
ELEMENTS_PER_MB = 500
MEASURED_ELEMENT_S = 7e-6
"""Processor time beside the steps for an element: 6.4 us in bracket_freezes, 8.3 us in plates, 1.6
us in plates_small."""
RATE = 2e7
RATE_OF_DIFFERENCES = 1e8
"""Element-steps a second of one core: 1.9e7 and 1.3e8 on the machine where plates_small was first
run; fixed, so that a study has the same batches everywhere."""
TIMED_S, STEPS = 0.5, 10
"""For how long a casting cools to tell the speed of this machine, and the steps between two looks
at the clock."""


class SolidificationSpeed(StoredSpeed[Solidification]):
    """See ``StoredSpeed``."""

    def computed_by(self, scenario: Solidification) -> str:
        """What the speed depends on: how heat is exchanged, our code, the dimension."""
        return f"{scenario.exchange} {source_hash()} {scenario.dimensions}D"

    def trial(self, scenario: Solidification, results: Path) -> float | None:
        """Element-steps per second of one core, in the first steps of a casting."""
        try:
            raster, filling = scene.drawn_raster(scenario), scene.filling_of(scenario)
            elements = placed(raster, scenario.layers)
            marching = scene.method_of(scenario).marching(elements, filling, raster)
            heat = filling.heat(elements)
            marching.advance(heat, 1e-9)  # compiled before it is timed
            before, begun_s = heat.element_steps, time.process_time()
            while time.process_time() - begun_s < TIMED_S:
                marching.advance(heat, STEPS * marching.step_s)
        except (ArithmeticError, ValueError):
            return None
        return (heat.element_steps - before) / (time.process_time() - begun_s)


class SolidificationPlanning(CastingPlanning[Solidification]):
    """See ``Planning``."""

    work_unit = "element-steps"
    solver = computation
    speed = SolidificationSpeed()
    measures = read_groups(
        Path(__file__).with_name("measures.yaml"),
        {
            "every casting": lambda _: once(),
            "every casting, by axis": lambda scenario: "xyz"[: scenario.dimensions],
            "with a probe, by its name": lambda scenario: [probe.name for probe in scenario.probes],
        },
    )
    measuring = (
        *CastingPlanning.measuring,
        "sandmould/analysis/feeding.py",
        "sandmould/analysis/freezing.py",
        "sandmould/kinds/solidification/execution.py",
    )

    def resolved(self, scenario: Solidification) -> Solidification:
        """The scenario with the hashes of its files, so that a changed mesh makes another run."""
        shapes = tuple(with_file_hash(shape) for shape in scenario.shapes)
        return scenario.model_copy(update={"shapes": shapes})

    def problems(self, scenario: Solidification) -> list[Problem]:
        """What keeps it from being computed, too much of it first: that cannot be laid out."""
        return [*_limit_problems(scenario)] or scene.problems(scenario)

    def threads(self, scenario: Solidification) -> int:
        """Of one process."""
        return scenario.threads

    def memory_mb(self, scenario: Solidification) -> int:
        """Libraries, and some 2 kB an element for the pairs of a kernel."""
        return BASE_MEMORY_MB + len(scene.elements_of(scenario).size_m) // ELEMENTS_PER_MB

    def planned_work(self, scenario: Solidification) -> float:
        """Element-steps, by Chvorinov's rule."""
        return scene.expected_element_steps(scenario)

    def predicted_s(self, scenario: Solidification) -> float:
        """Wall time at fixed speeds."""
        return self.planned_work(scenario) / (self._speed(scenario) * scenario.threads)

    def planned_s(self, scenario: Solidification) -> float:
        """Until all is solid, by Chvorinov's rule."""
        return scene.expected_s(scenario)

    def speed_class(self, scenario: Solidification) -> SpeedClass:
        """Elements or finite differences; runs of one class may share a job."""
        return computation.engine_of(scenario), scenario.dimensions

    def _speed(self, scenario: Solidification) -> float:
        return RATE_OF_DIFFERENCES if scenario.exchange == "difference" else RATE

    def beside_s(self, scenario: Solidification) -> float:
        """Laying out, hot spots, files and the picture."""
        return MEASURED_ELEMENT_S * len(scene.elements_of(scenario).size_m)

    def plan_cells(self, scenario: Solidification) -> Mapping[str, str]:
        """Elements, and the time at which all should be solid."""
        never = least_sand_share(scenario, scene.cooled_of(scenario)) >= 1.0
        return {
            "elements": f"{len(scene.elements_of(scenario).size_m):,}",
            "solid at about": "never" if never else f"{scene.expected_s(scenario):.0f} s",
        }

    def notes(self, scenario: Solidification) -> tuple[Note, ...]:
        """What elements and box make of the casting."""
        it = scene.cooled_of(scenario)
        share = least_sand_share(scenario, it)
        drawn, held = scene.drawn_volume_m3(scenario), scene.held_volume_m3(scenario)
        return notes(
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
                f"shapes.{n}": drawn_part(
                    shape, np.subtract(scenario.box.high_m, scenario.box.low_m)
                )
                for n, shape in enumerate(scenario.shapes)
                if isinstance(shape, SolidMesh)
            },
            largest_m=_largest_m(scenario),
        )


def _limit_problems(scenario: Solidification) -> Iterator[Problem]:
    """List what a casting asks too much of, by its sizes and times alone."""
    sides_m = np.subtract(scenario.box.high_m, scenario.box.low_m)
    cells = math.prod((sides_m / scenario.element_m).tolist())
    yield from CELLS.problems("element_m", cells, scenario.element_m)
    records = scenario.until_s / scenario.record_s
    yield from RECORDS.problems("record_s", records, scenario.record_s)


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
