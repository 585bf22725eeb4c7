"""Flows of more particles, steps or frames than can be computed."""

from __future__ import annotations

from collections.abc import Iterator

from sandmould.bad_input import Problem
from sandmould.casting.mps.shoulder import POUR_M_S
from sandmould.limits import FRAMES, PARTICLES, RECORDS
from sandmould.scenario.flow import MetalFlow, StillTank


def limit_problems(scenario: MetalFlow) -> Iterator[Problem]:
    """List what a flow asks too much of, by its sizes and times alone."""
    case, metal = scenario.case, scenario.metal
    # divided one by one: a power of a tiny particle is no number
    side_m = case.particle_m
    if isinstance(case, StillTank):
        sites = (case.width_m / side_m) * (case.depth_m / side_m)
    else:
        sites = (case.lower_m / side_m) * (case.lower_m / side_m) * (case.height_m / side_m)
        across = case.rate_kg_s / metal.density_kg_m3 / POUR_M_S / side_m / side_m
        yield from PARTICLES.problems("case.rate_kg_s", across, case.rate_kg_s)
    yield from PARTICLES.problems("case.particle_m", sites, side_m)
    frames = scenario.duration_s / scenario.record_s
    yield from FRAMES.problems("record_s", frames, scenario.record_s)
    for key in ("dt_max_s", "noise_window_s"):  # a row of a table each, or more
        interval_s = getattr(scenario, key)
        yield from RECORDS.problems(key, scenario.duration_s / interval_s, interval_s)
