"""MPS: how runs of the still fluid are measured and judged."""

from __future__ import annotations

import numpy as np
import pytest

from sandmould.casting.mps.flow import Flow
from sandmould.casting.mps.neighbours import find_candidates, find_neighbours
from sandmould.casting.mps.particles import FLUID, at_rest, lattice, make_kernel
from sandmould.casting.mps.probes import History, pressure_at, pressure_nearest
from sandmould.casting.mps.scene import open_tank
from sandmould.casting.mps.scheme import Scheme
from sandmould.casting.mps.stability_measures import StabilityRating, rate_stability, still_hops
from tests.verification.castings.still_fluid import (
    compression_gain,
    ideal_pa,
    probe_places,
    run_still,
    table_2,
)


def history(deviation_pa: float, top_m: float) -> History:
    """Pressure at 70 mm swings by a deviation round 1715 Pa, in steps of unequal length."""
    dt_s = np.array([1.0, 1.0, 2.0])
    swing = np.outer([1.0, 1.0, -1.0], np.full(3, deviation_pa))
    still = np.zeros(3)
    pressure = ideal_pa() + swing
    return History(np.cumsum(dt_s), dt_s, pressure, pressure, still, still, still, still + top_m)


def judged(seen: History, stopped: str = "", off: float = 0.0) -> StabilityRating:
    hops = still_hops(seen, 0.08, 2e-3)
    return rate_stability(stopped, hops, float(seen.deviation_pa()[-1]), off)


def test_verdicts_follow_the_numbers_of_the_text():
    quiet, loud = history(199.0, 0.081), history(201.0, 0.081)
    assert quiet.mean_pa() == pytest.approx(ideal_pa())
    assert quiet.deviation_pa() == pytest.approx([199.0] * 3)
    # the first two steps form a window, the third one of its own; then all three
    assert quiet.deviation_pa(2.0) == pytest.approx([199.0] * 3)
    assert quiet.deviation_pa(4.0) == pytest.approx([0.0] * 3, abs=1e-9)
    assert judged(quiet) is StabilityRating.EXCELLENT
    assert judged(loud) is StabilityRating.GOOD
    assert judged(quiet, off=-0.021) is StabilityRating.BIASED
    assert judged(quiet, off=0.019) is StabilityRating.EXCELLENT
    assert judged(loud, off=0.1) is StabilityRating.GOOD
    assert judged(history(10.0, 0.0861)) is StabilityRating.GOOD  # a particle left the surface
    assert judged(quiet, "the flow diverged") is StabilityRating.FAILED


def test_the_conditions_of_table_2():
    schemes = table_2()
    assert len(schemes) == 16
    first, last = schemes[0], schemes[-1]
    assert (first.dt_max_s, first.relaxations, first.source_share) == (1e-4, 1, 1.0)
    assert (last.dt_max_s, last.relaxations, last.source_share) == (2e-3, 10, 0.1)
    assert ideal_pa() == pytest.approx([735.0, 1225.0, 1715.0])


def test_a_run_that_fails_says_why():
    flow: Flow = open_tank(Scheme())
    flow.particles.velocity_m_s[flow.fluid] = (0.0, 20.0, 0.0)
    run = run_still(flow.scheme, 0.01, flow)
    assert run.verdict is StabilityRating.FAILED
    assert "diverged" in run.stopped
    assert np.isnan(run.mean_pa()).all()


def test_probes_read_a_known_field():
    flow = open_tank(Scheme())
    depth_m = 0.08 - flow.particles.position_m[:, 1]
    flow.pressure_pa = 2500.0 * 9.8 * depth_m
    # the probes lie in the middle of four particles: those round them average to the field itself
    assert pressure_at(flow, probe_places()) == pytest.approx(ideal_pa(), rel=1e-9)
    # the nearest particle is half a spacing off
    assert pressure_nearest(flow, probe_places()) == pytest.approx(ideal_pa(), abs=25.0)
    assert np.isnan(pressure_at(flow, np.array([[1.0, 1.0, 0.0]]))).all()


@pytest.mark.parametrize("dimension", [2, 3])
def test_gain_of_the_density_is_that_of_a_squeezed_lattice(dimension):
    kernel = make_kernel(dimension, 2e-3)
    squeeze = 1e-5
    length_m = 8 * 2e-3 * (1.0 - squeeze)
    period = (length_m, length_m, length_m if dimension == 3 else 0.0)
    fluid = at_rest(lattice((0,) * dimension, (8,) * dimension, 2e-3) * (1.0 - squeeze), FLUID)
    squeezed = kernel._replace(period_m=period)
    listed = find_candidates(squeezed, fluid.position_m, fluid.kind)
    density = find_neighbours(squeezed, listed, fluid.position_m, fluid.kind).density
    by_density = (density.mean() / kernel.lattice_density - 1.0) / (dimension * squeeze)
    # squeezing is finite: the second derivative adds some 1e-4
    assert compression_gain(kernel) == pytest.approx(by_density, rel=1e-3)


def test_the_papers_kernel_overshoots_at_a_full_source():
    gain = compression_gain(make_kernel(2, 2e-3))
    assert gain == pytest.approx(1.7, abs=0.05)
    assert abs(1.0 - 0.5 * gain) < 0.2 < abs(1.0 - gain)
