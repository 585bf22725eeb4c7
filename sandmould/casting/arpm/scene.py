"""A scenario of solidification as elements, materials and a method; what keeps it from one."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace
from functools import lru_cache
from typing import Any

import numpy as np

from sandmould.bad_input import BadInputError, Problem
from sandmould.casting.arpm.cut import with_cut
from sandmould.casting.arpm.elements import Elements, placed
from sandmould.casting.arpm.estimates import Cooled, cooled, freezes_s
from sandmould.casting.arpm.filling import Filling, check_casting
from sandmould.casting.arpm.kernel import check_sizes
from sandmould.casting.arpm.marching import STEP_SHARE
from sandmould.casting.arpm.material import ThermalMaterial
from sandmould.casting.arpm.method import HeatMethod
from sandmould.casting.arpm.raster import CASTING, Raster, painted
from sandmould.scenario.casting.shapes import Body, Rectangle, solid_of
from sandmould.scenario.casting.solidification import Solidification

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


@lru_cache(maxsize=8)
def _raster(box: Rectangle, shapes: tuple[Any, ...], element_m: float) -> Raster:
    solids = {n: solid_of(shape, f"shapes.{n - 1}") for n, shape in enumerate(shapes, start=1)}
    parts = painted(np.array(box.low_m), np.array(box.high_m), element_m, solids)
    # parts that touch are one casting: nothing resists the heat between them
    return replace(parts, material=np.minimum(parts.material, CASTING))


@lru_cache(maxsize=8)
def _drawn(box: Rectangle, shapes: tuple[Any, ...], element_m: float) -> Raster:
    solids = [solid_of(shape, f"shapes.{i}") for i, shape in enumerate(shapes)]
    return with_cut(_raster(box, shapes, element_m), solids)


@lru_cache(maxsize=8)
def _elements(
    box: Rectangle, shapes: tuple[Any, ...], element_m: float, layers: tuple[int, ...]
) -> Elements:
    return placed(_raster(box, shapes, element_m), layers)


@lru_cache(maxsize=8)
def _size_fault(
    box: Rectangle, shapes: tuple[Any, ...], element_m: float, layers: tuple[int, ...],
    kernel_size: float,
) -> str:  # fmt: skip
    """Why a kernel refuses these sizes of elements; nothing where it takes them."""
    try:
        check_sizes(_elements(box, shapes, element_m, layers), kernel_size)
    except ValueError as error:
        return str(error)
    return ""


@lru_cache(maxsize=8)
def _cooled(box: Rectangle, shapes: tuple[Any, ...], element_m: float) -> Cooled:
    return cooled(_drawn(box, shapes, element_m))


def cooled_of(scenario: Solidification) -> Cooled:
    """The casting as its sand sees it; ValueErrors are those of ``painted``."""
    return _cooled(scenario.box, scenario.shapes, scenario.element_m)


def raster_of(scenario: Solidification) -> Raster:
    """Cells of the smallest size, 0 for the mould; ValueErrors are those of ``painted``."""
    return _raster(scenario.box, scenario.shapes, scenario.element_m)


def elements_of(scenario: Solidification) -> Elements:
    """Elements of a scenario; ValueErrors are those of ``painted``."""
    return _elements(scenario.box, scenario.shapes, scenario.element_m, scenario.layers)


def drawn_raster(scenario: Solidification) -> Raster:
    """Cells with the volumes and areas of the drawing, for those who exchange over faces.

    Kernels know no faces: theirs are the painted cells.
    """
    raster_as = _raster if scenario.exchange in KERNEL_FORMS else _drawn
    return raster_as(scenario.box, scenario.shapes, scenario.element_m)


def filling_of(scenario: Solidification) -> Filling:
    """Materials: the mould, then the metal."""
    mould = ThermalMaterial(**scenario.mould.model_dump())
    metal = ThermalMaterial(**scenario.casting.model_dump())
    transfer = scenario.heat_transfer_w_m2_k
    initial_k = (scenario.initial_k.mould, scenario.initial_k.casting)
    return Filling((mould, metal), initial_k, 1.0 / transfer if transfer else 0.0)


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
    if scenario.exchange == "difference" and scenario.layers:
        valid = "empty with exchange difference: its cells have one size"
        yield Problem("layers", list(scenario.layers), valid)
    if scenario.exchange in KERNEL_FORMS and scenario.heat_transfer_w_m2_k:
        valid = (
            "faces or difference where heat_transfer_w_m2_k resists the heat: kernels do not see "
            "the surface on which it acts"
        )
        yield Problem("exchange", scenario.exchange, valid)
    if scenario.exchange in KERNEL_FORMS and scenario.layers and scenario.kernel_size < 2.0:
        yield Problem("kernel_size", scenario.kernel_size, "at least 2 where sizes double")
    yield from _places(scenario)
    names = [probe.name for probe in scenario.probes]
    for i, probe in enumerate(scenario.probes):
        if probe.name in names[:i]:
            yield Problem(f"probes.{i}.name", probe.name, "each name once")


def _places(scenario: Solidification) -> Iterator[Problem]:
    """Shapes and probes that are not in the box, or of another dimension."""
    low_m, high_m = np.array(scenario.box.low_m), np.array(scenario.box.high_m)
    room = f"the box from {low_m.tolist()} to {high_m.tolist()} m"
    for i, shape in enumerate(scenario.shapes):
        try:
            corners = solid_of(shape, f"shapes.{i}").corners()
        except BadInputError as error:
            yield from error.problems
            continue
        if corners.shape[1] != scenario.dimensions:
            valid = f"a shape of {scenario.dimensions}D as the box is"
            yield Problem(f"shapes.{i}.kind", shape.kind, valid)
        elif (corners < low_m).any() or (corners > high_m).any():
            reach = [corners.min(axis=0).tolist(), corners.max(axis=0).tolist()]
            yield Problem(f"shapes.{i}", reach, f"a {shape.kind} inside {room}")
    for i, probe in enumerate(scenario.probes):
        place = np.array(probe.at_m)
        if len(place) != scenario.dimensions or (place < low_m).any() or (place > high_m).any():
            yield Problem(f"probes.{i}.at_m", list(probe.at_m), f"a point in {room}")


def _layout_problems(scenario: Solidification) -> Iterator[Problem]:
    try:
        check_casting(elements_of(scenario), filling_of(scenario))
        yield from _ratio(scenario)
    except ValueError as error:
        kinds = [shape.kind for shape in scenario.shapes]
        valid = f"a casting that elements of {scenario.element_m:g} m can fill in its mould"
        yield Problem("shapes", kinds, f"{valid} ({error})")


def _ratio(scenario: Solidification) -> Iterator[Problem]:
    """Sizes of elements that a kernel's rule forbids."""
    if scenario.exchange in KERNEL_FORMS and scenario.layers:
        it = scenario
        fault = _size_fault(it.box, it.shapes, it.element_m, it.layers, it.kernel_size)
        if fault:
            valid = f"layers whose sizes keep the rule of 1/c_k ({fault})"
            yield Problem("layers", list(scenario.layers), valid)


def expected_s(scenario: Solidification) -> float:
    """Estimate when a casting is solid.

    As :func:`sandmould.casting.arpm.estimates.freezes_s`, with the sand that the box holds.

    Returns
    -------
    float, s
        Not beyond the time at which the run is stopped.
    """
    it = cooled_of(scenario)
    return min(freezes_s(scenario, it, it.sand_depth_m), scenario.until_s)


def held_volume_m3(scenario: Solidification) -> float:
    """Volume of the casting's elements as the run has them; area in m2 in 2D."""
    elements = placed(drawn_raster(scenario), scenario.layers)
    return float(elements.volume_m3[elements.material == CASTING].sum())


def expected_element_steps(scenario: Solidification) -> float:
    """Estimate the element-steps of a run, by the step that each element alone could take."""
    elements, filling = elements_of(scenario), filling_of(scenario)
    capacity = np.array([it.capacity_j_m3_k for it in filling.materials])
    spread = (capacity / filling.conductivity_w_m_k)[elements.material]
    limit_s = STEP_SHARE * spread * elements.size_m**2 / (2 * elements.dimensions)
    limit_s = np.minimum(limit_s, scenario.record_s)  # steps end at records
    lasts_s = expected_s(scenario)
    if scenario.exchange != "difference":
        return float(np.sum(lasts_s / limit_s))
    return len(limit_s) * lasts_s / float(limit_s.min())
