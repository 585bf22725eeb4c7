"""MPS: fluid at rest, hydrostatic pressure, and the paper's conditions on a small tank."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from sandmould.casting.mps.flow import Flow, FlowGuard
from sandmould.casting.mps.particles import make_kernel
from sandmould.casting.mps.probes import Watch, pressure_at
from sandmould.casting.mps.scene import still_tank
from sandmould.casting.mps.scheme import Scheme
from sandmould.casting.mps.shoulder import HOP_SPEED_M_S, PAPERS, Ladle, open_shoulder, ring_m
from tests.verification.castings.still_fluid import ideal_pa, run_still

SIZE_M = 2e-3
MR5 = Scheme(1e-3, 5, 0.5)


def small_tank(scheme: Scheme) -> Flow:
    """8 x 16 particles: 32 mm of metal, 784 Pa."""
    guard = FlowGuard(speed_m_s=2.0)
    return Flow(still_tank(8, 16), make_kernel(2, SIZE_M), scheme=scheme, guard=guard)


def test_pressure_is_hydrostatic_all_the_way_up():
    flow = small_tank(MR5)
    height_m = np.array([0.004, 0.012, 0.020, 0.026])
    place = np.stack((np.full(4, 0.008), height_m, np.zeros(4)), axis=1)
    rows = []
    flow.advance(0.06, lambda now: rows.append(pressure_at(now, place)))
    mean = np.array(rows[10:]).mean(axis=0)
    exact = 2500.0 * 9.8 * (0.032 - height_m)
    # the pressure is zero at the centres of the top row, 1 mm (25 Pa) below the surface, and the
    # column settles by as much
    assert mean == pytest.approx(exact, abs=60.0)
    assert np.all(np.diff(mean) < 0.0)


def test_volume_is_kept_and_fluid_stays_calm():
    flow = small_tank(MR5)
    watch = Watch(np.array([[0.008, 0.004, 0.0]]))
    flow.advance(0.1, watch)
    past = watch.history()
    # the column settles into the density that carries it: less than one particle
    assert past.top_m[-1] == pytest.approx(0.031, abs=SIZE_M)
    assert past.kinetic_energy_j_kg[-20:].mean() < 1e-3
    assert past.largest_speed_m_s.max() < 0.2


def noise_pa(scheme: Scheme) -> float:
    flow = small_tank(scheme)
    watch = Watch(np.array([[0.008, 0.004, 0.0]]))
    flow.advance(0.05, watch)
    return float(watch.history().deviation_pa()[0])


def test_multiple_relaxation_with_half_the_source_calms_the_pressure():
    plain = noise_pa(Scheme(2e-4, 1, 1.0))
    relaxed = noise_pa(MR5)
    # the paper's figure 5: thousands of Pa against less than 200
    assert relaxed < 100.0
    assert plain > 5.0 * relaxed


def test_the_gradient_as_printed_fails():
    flow = small_tank(replace(MR5, gradient="printed"))
    with pytest.raises(ArithmeticError):
        flow.advance(0.05)


def test_differences_to_the_own_pressure_do_not_calm():
    # measured 241 against 18 Pa
    assert noise_pa(replace(MR5, gradient="difference")) > 5.0 * noise_pa(MR5)


def test_the_papers_tank_at_its_recommended_setting():
    run = run_still(MR5, 0.03)
    assert not run.stopped
    # 25 Pa for the top row's centres and as much for settling
    assert run.mean_pa() == pytest.approx(ideal_pa(), abs=60.0)
    assert run.deviation_pa()[-1] < 200.0


def test_a_full_casting_with_a_shoulder_rests():
    """Particles of 5 mm: the smallest casting that shows the shoulder."""
    size_m = 5e-3
    flow = open_shoulder(size_m, MR5, full=True)
    across_m, under_m = 0.25 * (PAPERS.lower_m + PAPERS.upper_m), 0.5 * PAPERS.height_m - size_m
    place = np.vstack(([[0.0, 0.0, 0.5 * size_m]], ring_m(across_m, under_m)))
    pressures_pa, rises_m_s = [], []

    def each(now: Flow) -> None:
        if now.time_s > 0.01:
            pressures_pa.append(pressure_at(now, place))
            rises_m_s.append(now.particles.velocity_m_s[now.fluid, 2].max())

    flow.advance(0.025, each)
    assert max(rises_m_s) < HOP_SPEED_M_S
    pa_m = flow.metal.density_kg_m3 * 9.8
    assert 0.18 * pa_m == pytest.approx(4410.0)
    bottom_pa, *under_pa = np.mean(pressures_pa, axis=0)
    top_m = PAPERS.level_m(size_m, int(flow.fluid.sum()))
    # half a particle at the top carries no pressure: 61 Pa, and the bore is only five across
    assert bottom_pa == pytest.approx(pa_m * (top_m - 0.5 * size_m), rel=0.1)
    assert np.mean(under_pa) == pytest.approx(pa_m * (top_m - under_m), rel=0.15)


def test_a_ladle_pours_at_its_rate():
    flow = open_shoulder(5e-3, Scheme(2e-3, 1, 0.5), full=False)
    before = int(flow.fluid.sum())
    ladle = Ladle(flow, 0.3)
    flow.advance(0.02, ladle)
    mass_kg = 2500.0 * 5e-3**3
    assert ladle.poured_kg == pytest.approx((flow.fluid.sum() - before) * mass_kg)
    # a layer is added when all of it is due
    assert 0.0 <= 0.3 * flow.time_s - ladle.poured_kg < 10 * mass_kg
    with pytest.raises(ValueError, match="wider than the bore"):
        Ladle(flow, 5.0)
    with pytest.raises(ValueError, match="quarter of the bore"):
        open_shoulder(0.01, MR5, full=True)
