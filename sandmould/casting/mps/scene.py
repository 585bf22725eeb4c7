"""A scenario of flow as particles, scheme and probes; what keeps it from one, and its cost.

The paper's still fluid is 40 mm x 80 mm of molten aluminium at rest in a mould (figure 2).
"""

from __future__ import annotations

import math
from collections.abc import Iterator
from functools import lru_cache
from typing import NamedTuple

import numpy as np

from sandmould.arrays import Flags, Floats
from sandmould.bad_input import Problem
from sandmould.casting.mps.flow import Flow, FlowGuard, solves
from sandmould.casting.mps.particles import (
    FLUID,
    WALL_LAYERS,
    Particles,
    at_rest,
    lattice,
    make_kernel,
    mould_around,
)
from sandmould.casting.mps.scheme import G_M_S2, VISCOUS_SHARE, LiquidMetal, Scheme
from sandmould.casting.mps.shoulder import (
    PAPERS,
    POUR_HEIGHT,
    POUR_M_S,
    Ladle,
    open_shoulder,
    ring_m,
    stream,
)
from sandmould.scenario.casting.flow import MetalFlow, ShoulderedCylinder, StillTank

FEWEST = 4
"""Particles across a tank or a bore."""
DEPTHS = (3 / 8, 5 / 8, 7 / 8)
"""The paper's 30, 50 and 70 mm over 80."""
LEVELS = 8
"""Levels of metal at which the length of a step is foreseen."""
SPACING_M = 2e-3
COLUMNS, ROWS = 20, 40
WALL_ROWS = 51
"""Of the side walls: three layers by this height and a floor of three make the paper's 384."""


def still_tank(columns: int = COLUMNS, rows: int = ROWS, spacing_m: float = SPACING_M) -> Particles:
    """Fluid on its lattice in an open box, its walls as far above it as in the paper."""

    def is_cavity(place: Floats) -> Flags:
        inside = (place[:, 0] > 0.0) & (place[:, 0] < columns * spacing_m)
        return inside & (place[:, 1] > 0.0)

    top = rows + WALL_ROWS - ROWS
    sites = lattice((-WALL_LAYERS, -WALL_LAYERS), (columns + WALL_LAYERS, top), spacing_m)
    fluid = at_rest(lattice((0, 0), (columns, rows), spacing_m), FLUID)
    return fluid.joined(mould_around(sites, is_cavity, spacing_m))


def open_tank(
    scheme: Scheme,
    metal: LiquidMetal | None = None,
    columns: int = COLUMNS,
    rows: int = ROWS,
    spacing_m: float = SPACING_M,
) -> Flow:
    """Flow in the paper's tank, or in one of other size.

    The speed limit is that of a fall from three times the height of the walls: what started at
    rest can only be as fast if energy came from nowhere.
    """
    metal = metal or LiquidMetal()
    height_m = (rows + WALL_ROWS - ROWS) * spacing_m
    g = float(np.linalg.norm(metal.gravity_m_s2))
    margin = WALL_LAYERS * spacing_m
    guard = FlowGuard(
        float(np.sqrt(2.0 * g * 3.0 * height_m)),
        (-margin, -margin, -1.0),
        (columns * spacing_m + margin, 2.0 * height_m, 1.0),
    )
    tank = still_tank(columns, rows, spacing_m)
    return Flow(tank, make_kernel(2, spacing_m), metal, scheme, guard)


class PressureProbe(NamedTuple):
    """A place whose pressure is recorded."""

    name: str
    """Its column is <name>_pa."""
    at_m: tuple[float, float]
    """In a tank: x and height. In a cylinder: distance from the axis and height; the mean of eight
    places round the axis counts."""


def scheme_of(scenario: MetalFlow) -> Scheme:
    """How it is computed: the paper's way, with the keys that it varies."""
    return Scheme(
        scenario.dt_max_s, scenario.relaxations, scenario.source_share,
        collision_distance=scenario.collision_distance,
    )  # fmt: skip


def cells_of(case: StillTank) -> tuple[int, int]:
    """Columns and rows of a tank's particles."""
    return round(case.width_m / case.particle_m), round(case.depth_m / case.particle_m)


def open_flow(scenario: MetalFlow, full: bool = False) -> Flow:
    """Particles where they start, or in a cylinder full of metal at rest.

    ValueErrors are those of ``problems``.
    """
    case, metal, scheme = scenario.case, scenario.metal, scheme_of(scenario)
    plane = isinstance(case, StillTank)
    gravity = (0.0, -G_M_S2, 0.0) if plane else (0.0, 0.0, -G_M_S2)
    liquid = LiquidMetal(metal.density_kg_m3, metal.viscosity_m2_s, gravity)
    if isinstance(case, StillTank):
        return open_tank(scheme, liquid, *cells_of(case), case.particle_m)
    return open_shoulder(case.particle_m, scheme, full, liquid)


def ladle_of(scenario: MetalFlow, flow: Flow) -> Ladle | None:
    """What pours; None where nothing does."""
    case = scenario.case
    return None if isinstance(case, StillTank) else Ladle(flow, case.rate_kg_s, PAPERS)


def probes_of(scenario: MetalFlow) -> tuple[PressureProbe, ...]:
    """Where pressure is recorded: at the places of the paper."""
    case = scenario.case
    if isinstance(case, StillTank):
        depths_m = [share * case.depth_m for share in DEPTHS]
        return tuple(
            PressureProbe(f"h{1e3 * h:.0f}", (0.5 * case.width_m, case.depth_m - h))
            for h in depths_m
        )
    ring_at_m = 0.25 * (PAPERS.lower_m + PAPERS.upper_m)
    return (
        PressureProbe("bottom", (0.0, 0.5 * case.particle_m)),
        PressureProbe("shoulder", (ring_at_m, 0.5 * PAPERS.height_m - case.particle_m)),
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
    return PAPERS.level_m(case.particle_m, particles)


def ideal_pa(scenario: MetalFlow, particles: int) -> dict[str, float]:
    """Hydrostatic pressure at the probes under so many particles of metal, Pa."""
    top_m, metal = level_m(scenario, particles), scenario.metal
    by_depth = metal.density_kg_m3 * G_M_S2
    return {p.name: by_depth * max(0.0, top_m - p.at_m[1]) for p in probes_of(scenario)}


def deepest(scenario: MetalFlow) -> str:
    """Name of the deepest probe, by which a run is judged."""
    return min(probes_of(scenario), key=lambda probe: probe.at_m[1]).name


def problems(scenario: MetalFlow) -> list[Problem]:
    """List what keeps a well-typed scenario from being run."""
    case = scenario.case
    sizes = _tank_sizes(case) if isinstance(case, StillTank) else _cylinder_sizes(scenario, case)
    return [*sizes, *_times(scenario)]


def _tank_sizes(case: StillTank) -> Iterator[Problem]:
    for key in ("width_m", "depth_m"):
        length_m = getattr(case, key)
        cells = length_m / case.particle_m
        if abs(cells - round(cells)) > 1e-6 or cells < FEWEST:
            valid = f"at least {FEWEST} particles of {case.particle_m:g} m, and a whole number"
            yield Problem(f"case.{key}", length_m, valid)


def _cylinder_sizes(scenario: MetalFlow, case: ShoulderedCylinder) -> Iterator[Problem]:
    most_m = PAPERS.upper_m / FEWEST
    if case.particle_m > most_m * (1.0 + 1e-9):
        valid = f"at most {most_m:.4g} m, a quarter of the bore"
        yield Problem("case.particle_m", case.particle_m, valid)
    else:
        try:
            density = scenario.metal.density_kg_m3
            stream(case.particle_m, case.rate_kg_s, density, PAPERS)
        except ValueError as error:
            yield Problem("case.rate_kg_s", case.rate_kg_s, f"less ({error})")


def _times(scenario: MetalFlow) -> Iterator[Problem]:
    ends_s = scenario.duration_s
    if scenario.measured_from_s >= ends_s:
        valid = f"below the duration, {ends_s:g} s"
        yield Problem("measured_from_s", scenario.measured_from_s, valid)
    if scenario.record_s > ends_s:
        yield Problem("record_s", scenario.record_s, f"at most the duration, {ends_s:g} s")


@lru_cache(maxsize=8)
def _counts(case: StillTank | ShoulderedCylinder) -> tuple[int, int, int]:
    """Particles of the mould, of fluid at the start and of fluid at the end."""
    flow = open_flow(MetalFlow(case=case))
    begins = int(flow.fluid.sum())
    mould = len(flow.particles.kind) - begins
    if isinstance(case, StillTank):
        return mould, begins, begins
    return mould, begins, len(PAPERS.filled_m(case.particle_m))


def fluid_of(scenario: MetalFlow) -> int:
    """Particles of fluid when the mould is full."""
    return _counts(scenario.case)[2]


def mass_percent(scenario: MetalFlow) -> float:
    """What the particles of a full mould hold over what is drawn, less 100, %."""
    case = scenario.case
    if isinstance(case, StillTank):
        return 0.0
    held_m3 = fluid_of(scenario) * case.particle_m**3
    return 100.0 * (held_m3 / PAPERS.volume_m3 - 1.0)


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
        fastest = math.sqrt(POUR_M_S**2 + 2.0 * G_M_S2 * drop_m)
        dt_s = min(still_s, scheme.courant * case.particle_m / fastest)
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
    return 0.0 if isinstance(case, StillTank) else PAPERS.height_m + POUR_HEIGHT * case.particle_m
