"""Flows of more particles, steps or frames than can be computed."""

from __future__ import annotations

from collections.abc import Iterator

from sandmould.bad_input import Problem
from sandmould.casting.mps.shoulder import PAPERS, POUR_M_S
from sandmould.limits import FRAMES, PARTICLES, RECORDS
from sandmould.scenario.casting.flow import MetalFlow, StillTank


def limit_problems(scenario: MetalFlow) -> Iterator[Problem]:
    """List what a flow asks too much of, by its sizes and times alone."""
    case, metal = scenario.case, scenario.metal
    # divided one by one: a power of a tiny particle is no number
    side_m = case.particle_m
    if isinstance(case, StillTank):
        sites = (case.width_m / side_m) * (case.depth_m / side_m)
    else:
        sites = (PAPERS.lower_m / side_m) * (PAPERS.lower_m / side_m) * (PAPERS.height_m / side_m)
        across = case.rate_kg_s / metal.density_kg_m3 / POUR_M_S / side_m / side_m
        yield from PARTICLES.problems("case.rate_kg_s", across, case.rate_kg_s)
    yield from PARTICLES.problems("case.particle_m", sites, side_m)
    frames = scenario.duration_s / scenario.record_s
    yield from FRAMES.problems("record_s", frames, scenario.record_s)
    longest_s = scenario.dt_max_s  # a row of a table each, or more
    yield from RECORDS.problems("dt_max_s", scenario.duration_s / longest_s, longest_s)
