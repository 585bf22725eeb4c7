"""Each engine is stable up to the critical step of (42) and not beyond.

All three are the same central differences with the damping force at the velocity of half a step
ago, so the bound is exact for each. LAMMPS takes damping as a restitution, and zeta = 1 as 1e-100:
its damping ratio is 0.99991 there, its limit 7e-5 higher.
"""

from __future__ import annotations

import math

import pytest

from benchmarks.stability.runs import BLOWS_UP, DRIFTS, STABLE, disturb
from benchmarks.stability.scenes import limits_of, scenario_of
from sandmould.engines.registry import engine_problem
from tests.liggghts_scenes import needs_liggghts

ENGINES = ["reference", "lammps", pytest.param("liggghts", marks=needs_liggghts)]


@pytest.mark.parametrize("damping_ratio", [0.0, 0.5, 1.0])
@pytest.mark.parametrize("engine", ENGINES)
def test_one_contact_is_stable_up_to_the_critical_step(engine: str, damping_ratio: float) -> None:
    assert engine_problem(scenario_of("contact", engine, damping_ratio)) is None
    limits = limits_of("contact", damping_ratio)
    critical_s = limits.whole.undamped_s * (math.sqrt(1 + damping_ratio**2) - damping_ratio)
    assert limits.whole.damped_s == pytest.approx(critical_s, rel=1e-9)
    assert disturb("contact", engine, damping_ratio, 0.95 * critical_s, True).outcome == STABLE
    beyond = disturb("contact", engine, damping_ratio, 1.05 * critical_s, True)
    # Damped, the grain is caught by its dashpot for a while: it rattles and stays on the floor.
    assert beyond.outcome == (BLOWS_UP if damping_ratio == 0.0 else DRIFTS)
    assert beyond.energy_ratio > 1e6


@pytest.mark.parametrize("damping_ratio", [0.0, 1.0])
def test_limit_of_a_bed_is_that_of_its_contacts(damping_ratio: float) -> None:
    critical_s = limits_of("bed", damping_ratio).whole.damped_s
    below = disturb("bed", "reference", damping_ratio, 0.99 * critical_s, True)
    above = disturb("bed", "reference", damping_ratio, 1.01 * critical_s, True)
    assert (below.outcome, above.outcome) == (STABLE, DRIFTS)


@pytest.mark.parametrize("engine", ENGINES)
def test_bed_is_stable_at_the_planned_step(engine: str) -> None:
    for damping_ratio in (0.0, 1.0):
        planned_s = limits_of("bed", damping_ratio).planned_s
        assert disturb("bed", engine, damping_ratio, planned_s, True).outcome == STABLE
