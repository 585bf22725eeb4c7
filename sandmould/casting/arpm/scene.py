"""A scenario of solidification as elements, materials and a method; what keeps it from one."""

from __future__ import annotations

from collections.abc import Iterator
from functools import lru_cache
from typing import Any, NamedTuple

import numpy as np

from sandmould.arrays import Flags
from sandmould.bad_input import BadInputError, Problem
from sandmould.casting.arpm.cut import with_cut
from sandmould.casting.arpm.elements import Elements, placed
from sandmould.casting.arpm.estimates import Cooled, cooled, freezes_s
from sandmould.casting.arpm.filling import Filling, check_casting
from sandmould.casting.arpm.kernel import check_sizes
from sandmould.casting.arpm.marching import STEP_SHARE
from sandmould.casting.arpm.material import ThermalMaterial, thermal
from sandmould.casting.arpm.method import HeatMethod
from sandmould.casting.arpm.raster import CASTING, MOULD, Raster, inside_solid, painted
from sandmould.casting.arpm.varying import Transfer
from sandmould.scenario.casting.shapes import Body, Rectangle, solid_of
from sandmould.scenario.casting.solidification import Solidification
from sandmould.scenario.solids import SolidMesh, unit_hint

AIR = ThermalMaterial("air", 1e9, 1e6, 1e6)
"""Stands for air that stays as it is: a layer of elements outside of the box."""
KERNEL_FORMS = ("printed", "corrected", "symmetric")


def series_columns(scenario: Solidification) -> tuple[str, str, str]:
    """Columns of ``series.tsv`` beside the probes'; in 2D heat is that of a metre across."""
    heat = "enthalpy_j_m" if scenario.dimensions == 2 else "enthalpy_j"
    return "time_s", "solidified_fraction", heat


def solids_of(scenario: Solidification) -> list[Body]:
    """Geometry of the casting's parts.

    Raises
    ------
    BadInputError
        When a file cannot be read, bounds no solid or has changed since the plan.
    """
    return [solid_of(shape, f"shapes.{i}") for i, shape in enumerate(scenario.shapes)]


class _Drawing(NamedTuple):
    """What of a scenario makes its cells."""

    box: Rectangle
    shapes: tuple[Any, ...]
    inserts: tuple[Any, ...]
    sides: tuple[str, ...]
    """Those that air cools."""
    element_m: float


def _drawing(scenario: Solidification) -> _Drawing:
    inserts = tuple(it.shape for it in scenario.inserts)
    sides = scenario.air.sides if scenario.air else ()
    return _Drawing(scenario.box, scenario.shapes, inserts, sides, scenario.element_m)


@lru_cache(maxsize=8)
def _raster(drawing: _Drawing) -> Raster:
    box, shapes, inserts, sides, element_m = drawing
    # parts that touch or overlap are one casting, which lies in all else
    bodies = [solid_of(shape, f"inserts.{n}.shape") for n, shape in enumerate(inserts)]
    bodies += [solid_of(shape, f"shapes.{n}") for n, shape in enumerate(shapes)]
    number = [MOULD, *range(CASTING + 1, CASTING + 1 + len(inserts)), *[CASTING] * len(shapes)]
    raster = painted(
        np.array(box.low_m), np.array(box.high_m), element_m, dict(enumerate(bodies, start=1))
    )
    axes = "xyz"[: len(box.low_m)]
    beside = np.array([[f"{end}_{axis}" in sides for end in ("low", "high")] for axis in axes])
    air = CASTING + 1 + len(inserts)
    material = np.pad(np.array(number)[raster.material], beside.astype(int), constant_values=air)
    return Raster(material, element_m, raster.low_m - element_m * beside[:, 0])


@lru_cache(maxsize=8)
def _drawn(drawing: _Drawing) -> Raster:
    solids = [solid_of(shape, f"shapes.{i}") for i, shape in enumerate(drawing.shapes)]
    return with_cut(_raster(drawing), solids)


@lru_cache(maxsize=8)
def _elements(drawing: _Drawing, layers: tuple[int, ...]) -> Elements:
    return placed(_raster(drawing), layers)


@lru_cache(maxsize=8)
def _size_fault(drawing: _Drawing, layers: tuple[int, ...], kernel_size: float) -> str:
    """Why a kernel refuses these sizes of elements; nothing where it takes them."""
    try:
        check_sizes(_elements(drawing, layers), kernel_size)
    except ValueError as error:
        return str(error)
    return ""


@lru_cache(maxsize=8)
def _cooled(drawing: _Drawing) -> Cooled:
    return cooled(_drawn(drawing), len(drawing.inserts))


def cooled_of(scenario: Solidification) -> Cooled:
    """The casting as its sand sees it; ValueErrors are those of ``painted``."""
    return _cooled(_drawing(scenario))


def raster_of(scenario: Solidification) -> Raster:
    """Cells of the smallest size, 0 for the mould; ValueErrors are those of ``painted``."""
    return _raster(_drawing(scenario))


def elements_of(scenario: Solidification) -> Elements:
    """Elements of a scenario; ValueErrors are those of ``painted``."""
    return _elements(_drawing(scenario), scenario.layers)


def risers_of(scenario: Solidification, elements: Elements) -> Flags:
    """Which elements lie in risers, (n,) bool: these have what they share with other parts."""
    found = np.zeros(len(elements.size_m), dtype=np.bool_)
    for number in scenario.risers:
        solid = solid_of(scenario.shapes[number], f"shapes.{number}")
        found |= inside_solid(solid, elements.position_m)
    return found


def drawn_raster(scenario: Solidification) -> Raster:
    """Cells with the volumes and areas of the drawing, for those who exchange over faces.

    Kernels know no faces: theirs are the painted cells.
    """
    raster_as = _raster if scenario.exchange in KERNEL_FORMS else _drawn
    return raster_as(_drawing(scenario))


def filling_of(scenario: Solidification) -> Filling:
    """Materials: the mould, the metal, inserts, and air."""
    metal, air = thermal(scenario.casting), scenario.air
    materials = [thermal(scenario.mould), metal, *map(thermal, scenario.inserts)]
    start = scenario.initial_k
    initial_k = [start.mould, start.casting, *(it.initial_k or start.mould
                                               for it in scenario.inserts)]  # fmt: skip
    over_time = scenario.heat_transfer_over == "time"
    to_mould = scenario.heat_transfer_w_m2_k
    passes = [to_mould, *(it.heat_transfer_w_m2_k or to_mould for it in scenario.inserts)]
    pairs = [(MOULD, CASTING), *((CASTING, n) for n in range(CASTING + 1, len(materials)))]
    transfers = {
        pair: Transfer(h, over_time, scenario.coating_m2k_w)
        for pair, h in zip(pairs, passes, strict=True)
    }
    if air is not None:
        transfers |= {(n, len(materials)): Transfer(air.heat_transfer_w_m2_k)
                      for n in range(len(materials))}  # fmt: skip
        materials.append(AIR)
        initial_k.append(air.temperature_k)
    return Filling(
        tuple(materials), tuple(initial_k), 0.0, transfers, scenario.read_at_solid_fraction
    )


def method_of(scenario: Solidification) -> HeatMethod:
    """How elements exchange heat and go forward in time."""
    return HeatMethod(scenario.exchange, kernel_size=scenario.kernel_size, threads=scenario.threads)


def problems(scenario: Solidification) -> list[Problem]:
    """List what keeps a well-typed scenario from being run."""
    return [*_misfits(scenario)] or [*_layout_problems(scenario)]


def _misfits(scenario: Solidification) -> Iterator[Problem]:
    pour_k, solidus_k = scenario.initial_k.casting, scenario.casting.solidus_k
    if pour_k < solidus_k:
        valid = f"at least the solidus of {scenario.casting.name}, {solidus_k:g} K"
        yield Problem("initial_k.casting", pour_k, valid)
    if scenario.initial_k.mould >= solidus_k:
        valid = f"below the solidus of {scenario.casting.name}, {solidus_k:g} K"
        yield Problem("initial_k.mould", scenario.initial_k.mould, valid)
    for i, it in enumerate(scenario.inserts):
        if (it.initial_k or 0.0) >= solidus_k:
            valid = f"below the solidus of {scenario.casting.name}, {solidus_k:g} K"
            yield Problem(f"inserts.{i}.initial_k", it.initial_k, valid)
    axes = "xyz"[: scenario.dimensions]
    if scenario.air and (far := [side for side in scenario.air.sides if side[-1] not in axes]):
        yield Problem("air.sides", far, f"sides along {' and '.join(axes)}, as the box has them")
    if scenario.exchange == "difference" and scenario.layers:
        valid = "empty with exchange difference: its cells have one size"
        yield Problem("layers", list(scenario.layers), valid)
    filling, exchange = filling_of(scenario), scenario.exchange
    if exchange != "faces" and filling.curves is not None:
        valid = "faces, where a conductivity or heat transfer has a curve"
        yield Problem("exchange", exchange, valid)
    elif exchange in KERNEL_FORMS and filling.least_m2k_w.any():
        valid = (
            "faces or difference where heat_transfer_w_m2_k resists the heat: kernels do not see "
            "the surface on which it acts"
        )
        yield Problem("exchange", scenario.exchange, valid)
    if scenario.exchange in KERNEL_FORMS and scenario.layers and scenario.kernel_size < 2.0:
        yield Problem("kernel_size", scenario.kernel_size, "at least 2 where sizes double")
    yield from _places(scenario)
    for i, number in enumerate(scenario.risers):
        if number >= len(scenario.shapes):
            yield Problem(f"risers.{i}", number, f"at most {len(scenario.shapes) - 1}, a shape")
    names = [probe.name for probe in scenario.probes]
    for i, probe in enumerate(scenario.probes):
        if probe.name in names[:i]:
            yield Problem(f"probes.{i}.name", probe.name, "each name once")


def _places(scenario: Solidification) -> Iterator[Problem]:
    """Shapes and probes that are not in the box, or of another dimension."""
    low_m, high_m = np.array(scenario.box.low_m), np.array(scenario.box.high_m)
    room = f"the box from {low_m.tolist()} to {high_m.tolist()} m"
    bodies = {f"shapes.{i}": shape for i, shape in enumerate(scenario.shapes)}
    bodies |= {f"inserts.{i}.shape": it.shape for i, it in enumerate(scenario.inserts)}
    for key, shape in bodies.items():
        try:
            corners = solid_of(shape, key).corners()
        except BadInputError as error:
            yield from error.problems
            continue
        # meshes in files have fewer digits than the box
        near_m = 1e-6 * (high_m - low_m)
        if corners.shape[1] != scenario.dimensions:
            valid = f"a shape of {scenario.dimensions}D as the box is"
            if isinstance(shape, SolidMesh):
                valid += (
                    ", or a box with three coordinates; where it ends at both sides of a plate no "
                    "heat passes, so the plate freezes as in 2D"
                )
            yield Problem(f"{key}.kind", shape.kind, valid)
        elif (corners < low_m - near_m).any() or (corners > high_m + near_m).any():
            reach = [corners.min(axis=0).tolist(), corners.max(axis=0).tolist()]
            hint = ""
            if isinstance(shape, SolidMesh):
                hint = unit_hint(shape, np.ptp(corners, axis=0), high_m - low_m)
            yield Problem(key, reach, f"a {shape.kind} inside {room}{hint}")
    for i, probe in enumerate(scenario.probes):
        place = np.array(probe.at_m)
        if len(place) != scenario.dimensions or (place < low_m).any() or (place > high_m).any():
            yield Problem(f"probes.{i}.at_m", list(probe.at_m), f"a point in {room}")


def _layout_problems(scenario: Solidification) -> Iterator[Problem]:
    try:
        elements = elements_of(scenario)
        check_casting(elements, filling_of(scenario))
        if scenario.risers and risers_of(scenario, elements)[elements.material == CASTING].all():
            valid = "shapes that leave some of the casting for them to feed"
            yield Problem("risers", list(scenario.risers), valid)
        yield from _ratio(scenario)
    except ValueError as error:
        kinds = [shape.kind for shape in scenario.shapes]
        valid = f"a casting that elements of {scenario.element_m:g} m can fill in its mould"
        yield Problem("shapes", kinds, f"{valid} ({error})")


def _ratio(scenario: Solidification) -> Iterator[Problem]:
    """Sizes of elements that a kernel's rule forbids."""
    if scenario.exchange in KERNEL_FORMS and scenario.layers:
        fault = _size_fault(_drawing(scenario), scenario.layers, scenario.kernel_size)
        if fault:
            valid = f"layers whose sizes keep the rule of 1/c_k ({fault})"
            yield Problem("layers", list(scenario.layers), valid)


def expected_s(scenario: Solidification) -> float:
    """Estimate when a casting is solid.

    As :func:`sandmould.casting.arpm.estimates.freezes_s`, with the sand that the box holds.

    Not beyond the time at which the run is stopped.
    """
    it = cooled_of(scenario)
    return min(freezes_s(scenario, it, it.sand_depth_m), scenario.until_s)


def drawn_volume_m3(scenario: Solidification) -> float:
    """Volume of the casting as drawn; area in m2 in 2D.

    What several shapes hold counts once, as far as cells of the smallest size tell.
    """
    solids, raster = solids_of(scenario), raster_of(scenario)
    drawn_m3 = sum(abs(solid.measure) for solid in solids)
    if len(solids) == 1:
        return drawn_m3
    holders = np.sum([inside_solid(solid, raster.centre_m) for solid in solids], axis=0)
    again = int(np.maximum(holders - 1, 0).sum())
    return drawn_m3 - again * raster.cell_m**scenario.dimensions


def held_volume_m3(scenario: Solidification) -> float:
    """Volume of the casting's elements as the run has them; area in m2 in 2D."""
    elements = placed(drawn_raster(scenario), scenario.layers)
    return float(elements.volume_m3[elements.material == CASTING].sum())


def expected_element_steps(scenario: Solidification) -> float:
    """Estimate the element-steps of a run, by the step that each element alone could take."""
    elements, filling = elements_of(scenario), filling_of(scenario)
    capacity = filling.table.rows[:, 0]
    spread = (capacity / filling.conductivity_w_m_k)[elements.material]
    limit_s = STEP_SHARE * spread * elements.size_m**2 / (2 * elements.dimensions)
    limit_s = np.minimum(limit_s, scenario.record_s)  # steps end at records
    lasts_s = expected_s(scenario)
    if scenario.exchange != "difference":
        return float(np.sum(lasts_s / limit_s))
    return len(limit_s) * lasts_s / float(limit_s.min())
