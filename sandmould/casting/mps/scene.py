"""A scenario of flow as particles, scheme and probes; what keeps it from one, and its cost."""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import fields
from functools import lru_cache

import numpy as np

from sandmould.bad_input import Problem
from sandmould.casting.mps.flow import Flow, solves
from sandmould.casting.mps.particles import Floats
from sandmould.casting.mps.scheme import VISCOUS_SHARE, LiquidMetal, Scheme
from sandmould.casting.mps.shoulder import (
    POUR_HEIGHT,
    POUR_M_S,
    Casting,
    Ladle,
    open_shoulder,
    ring_m,
    stream,
)
from sandmould.casting.mps.tank import open_tank
from sandmould.scenario.flow import MetalFlow, PressureProbe, ShoulderedCylinder, StillTank

FEWEST = 4
"""Particles across a tank or a bore."""
DEPTHS = (3 / 8, 5 / 8, 7 / 8)
"""The paper's 30, 50 and 70 mm over 80."""
LEVELS = 8
"""Levels of metal at which the length of a step is foreseen."""


def scheme_of(scenario: MetalFlow) -> Scheme:
    """How it is computed; keys are called as the scheme's own."""
    return Scheme(**{field.name: getattr(scenario, field.name) for field in fields(Scheme)})


def cells_of(case: StillTank) -> tuple[int, int]:
    """Columns and rows of a tank's particles."""
    return round(case.width_m / case.particle_m), round(case.depth_m / case.particle_m)


def casting_of(case: ShoulderedCylinder) -> Casting:
    """Its shape."""
    return Casting(case.height_m, case.lower_m, case.upper_m)


def open_flow(scenario: MetalFlow) -> Flow:
    """Particles where they start; ValueErrors are those of ``problems``."""
    case, metal, scheme = scenario.case, scenario.metal, scheme_of(scenario)
    plane = isinstance(case, StillTank)
    gravity = (0.0, -metal.gravity_m_s2, 0.0) if plane else (0.0, 0.0, -metal.gravity_m_s2)
    liquid = LiquidMetal(metal.density_kg_m3, metal.viscosity_m2_s, gravity)
    if isinstance(case, StillTank):
        return open_tank(scheme, liquid, *cells_of(case), case.particle_m)
    full = case.starts == "full"
    return open_shoulder(case.particle_m, scheme, full, liquid, casting_of(case))


def ladle_of(scenario: MetalFlow, flow: Flow) -> Ladle | None:
    """What pours; None where nothing does."""
    case = scenario.case
    if isinstance(case, StillTank) or case.starts == "full":
        return None
    return Ladle(flow, case.rate_kg_s, casting_of(case))


def probes_of(scenario: MetalFlow) -> tuple[PressureProbe, ...]:
    """The scenario's probes, or the paper's places."""
    case = scenario.case
    if scenario.probes:
        return scenario.probes
    if isinstance(case, StillTank):
        depths_m = [share * case.depth_m for share in DEPTHS]
        return tuple(
            PressureProbe(name=f"h{1e3 * h:.0f}", at_m=(0.5 * case.width_m, case.depth_m - h))
            for h in depths_m
        )
    ring_at_m = 0.25 * (case.lower_m + case.upper_m)
    return (
        PressureProbe(name="bottom", at_m=(0.0, 0.5 * case.particle_m)),
        PressureProbe(name="shoulder", at_m=(ring_at_m, 0.5 * case.height_m - case.particle_m)),
    )


def places_of(scenario: MetalFlow) -> list[Floats]:
    """Places that each probe averages over, (k, 3) float64, m."""
    places = []
    for probe in probes_of(scenario):
        across_m, height_m = probe.at_m
        if isinstance(scenario.case, StillTank):
            places.append(np.array([[across_m, height_m, 0.0]]))
        else:
            places.append(ring_m(across_m, height_m)[: None if across_m > 0.0 else 1])
    return places


def level_m(scenario: MetalFlow, particles: int) -> float:
    """Height that so many particles fill the mould to."""
    case = scenario.case
    if isinstance(case, StillTank):
        return case.depth_m
    return casting_of(case).level_m(case.particle_m, particles)


def ideal_pa(scenario: MetalFlow, particles: int) -> dict[str, float]:
    """Hydrostatic pressure at the probes under so many particles of metal, Pa."""
    top_m, metal = level_m(scenario, particles), scenario.metal
    by_depth = metal.density_kg_m3 * metal.gravity_m_s2
    return {p.name: by_depth * max(0.0, top_m - p.at_m[1]) for p in probes_of(scenario)}


def deepest(scenario: MetalFlow) -> str:
    """Name of the deepest probe, by which a run is judged."""
    return min(probes_of(scenario), key=lambda probe: probe.at_m[1]).name


def problems(scenario: MetalFlow) -> list[Problem]:
    """List what keeps a well-typed scenario from being run."""
    case = scenario.case
    sizes = _tank_sizes(case) if isinstance(case, StillTank) else _cylinder_sizes(scenario, case)
    return [*sizes, *_times(scenario), *_probes(scenario)]


def _tank_sizes(case: StillTank) -> Iterator[Problem]:
    for key in ("width_m", "depth_m"):
        length_m = getattr(case, key)
        cells = length_m / case.particle_m
        if abs(cells - round(cells)) > 1e-6 or cells < FEWEST:
            valid = f"at least {FEWEST} particles of {case.particle_m:g} m, and a whole number"
            yield Problem(f"case.{key}", length_m, valid)


def _cylinder_sizes(scenario: MetalFlow, case: ShoulderedCylinder) -> Iterator[Problem]:
    most_m = min(case.upper_m, 0.5 * case.height_m) / FEWEST
    if case.particle_m > most_m * (1.0 + 1e-9):
        valid = f"at most {most_m:.4g} m, a quarter of the bore and of half the height"
        yield Problem("case.particle_m", case.particle_m, valid)
    elif case.starts == "empty":
        try:
            density = scenario.metal.density_kg_m3
            stream(case.particle_m, case.rate_kg_s, density, casting_of(case))
        except ValueError as error:
            yield Problem("case.rate_kg_s", case.rate_kg_s, f"less ({error})")


def _times(scenario: MetalFlow) -> Iterator[Problem]:
    ends_s = scenario.duration_s
    if scenario.measured_from_s >= ends_s:
        valid = f"below the duration, {ends_s:g} s"
        yield Problem("measured_from_s", scenario.measured_from_s, valid)
    if scenario.record_s > ends_s:
        yield Problem("record_s", scenario.record_s, f"at most the duration, {ends_s:g} s")


def _probes(scenario: MetalFlow) -> Iterator[Problem]:
    case, names = scenario.case, [probe.name for probe in scenario.probes]
    for i, probe in enumerate(scenario.probes):
        across_m, height_m = probe.at_m
        if isinstance(case, StillTank):
            inside = 0.0 < across_m < case.width_m and 0.0 < height_m < case.depth_m
            where = f"above 0 and below {case.width_m:g} m across and {case.depth_m:g} m high"
        else:
            inside = across_m >= 0.0 and bool(
                casting_of(case).holds(np.array([[across_m, 0.0, height_m]]))[0]
            )
            where = "a distance from the axis and a height inside the casting"
        if not inside:
            yield Problem(f"probes.{i}.at_m", list(probe.at_m), where)
        if probe.name in names[:i]:
            yield Problem(f"probes.{i}.name", probe.name, "each name once")


@lru_cache(maxsize=8)
def _counts(case: StillTank | ShoulderedCylinder) -> tuple[int, int, int]:
    """Particles of the mould, of fluid at the start and of fluid at the end."""
    flow = open_flow(MetalFlow(case=case))
    begins = int(flow.fluid.sum())
    mould = len(flow.particles.kind) - begins
    if isinstance(case, StillTank) or case.starts == "full":
        return mould, begins, begins
    return mould, begins, len(casting_of(case).filled_m(case.particle_m))


def fluid_of(scenario: MetalFlow) -> int:
    """Particles of fluid when the mould is full."""
    return _counts(scenario.case)[2]


def expected_work(scenario: MetalFlow) -> float:
    """Foresee the work of a run, as ``flow.Cost`` counts it.

    Metal that stands takes the largest step; a stream that falls limits it by eq. (8).
    """
    case, scheme = scenario.case, scheme_of(scenario)
    mould, begins, ends = _counts(case)
    viscosity = scenario.metal.viscosity_m2_s
    viscous_s = VISCOUS_SHARE * case.particle_m**2 / viscosity if viscosity > 0.0 else math.inf
    still_s = min(scenario.dt_max_s, viscous_s)
    poured_s = _pouring_s(scenario, ends - begins)
    still_steps = max(0.0, scenario.duration_s - poured_s) / still_s
    work = still_steps * solves(scheme, ends, ends + mould)
    part_s = min(poured_s, scenario.duration_s) / LEVELS
    for part in range(LEVELS if poured_s else 0):
        fluid = int(begins + (part + 0.5) * part_s / poured_s * (ends - begins))
        drop_m = max(0.0, _mouth_m(case) - level_m(scenario, fluid))
        fastest = math.sqrt(POUR_M_S**2 + 2.0 * scenario.metal.gravity_m_s2 * drop_m)
        dt_s = min(still_s, scenario.courant * case.particle_m / fastest)
        work += part_s / dt_s * solves(scheme, fluid, fluid + mould)
    return work


def _pouring_s(scenario: MetalFlow, particles: int) -> float:
    """Time that so many particles take to be poured in."""
    case = scenario.case
    if isinstance(case, StillTank):
        return 0.0
    return particles * scenario.metal.density_kg_m3 * case.particle_m**3 / case.rate_kg_s


def _mouth_m(case: StillTank | ShoulderedCylinder) -> float:
    """Height that metal is poured from."""
    return 0.0 if isinstance(case, StillTank) else case.height_m + POUR_HEIGHT * case.particle_m
