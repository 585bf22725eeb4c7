"""MPS: bad input is refused, runs that go wrong are stopped, progress is told."""

from __future__ import annotations

import numpy as np
import pytest

from sandmould.casting.mps.flow import DivergedError, EscapedError, Flow, FlowGuard, FlowProgress
from sandmould.casting.mps.particles import DUMMY, FLUID, WALL, at_rest, lattice, make_kernel
from sandmould.casting.mps.pressure import ClosedRegionError
from sandmould.casting.mps.scene import still_tank
from sandmould.casting.mps.scheme import LiquidMetal, Scheme

SIZE_M = 2e-3


def small_tank(guard: FlowGuard | None = None, scheme: Scheme | None = None) -> Flow:
    return Flow(still_tank(6, 6), make_kernel(2, SIZE_M), scheme=scheme, guard=guard)


@pytest.mark.parametrize(
    ("wrong", "word"),
    [
        ({"dt_max_s": 0.0}, "dt_max_s"),
        ({"relaxations": 0}, "relaxations"),
        ({"source_share": 1.5}, "source_share"),
        ({"surface": 0.5}, "surface"),
        ({"tolerance": -1.0}, "tolerance"),
        ({"shifting": 2.0}, "shifting"),
        ({"collision_distance": 1.1}, "collision_distance"),
        ({"restitution": -0.1}, "restitution"),
        ({"source": "mass"}, "source is 'mass'"),
        ({"gradient": "steep"}, "gradient is 'steep'"),
    ],
)
def test_schemes_that_cannot_run(wrong, word):
    with pytest.raises(ValueError, match=word):
        Scheme(**wrong)


def test_metals_and_kernels_that_cannot_be():
    with pytest.raises(ValueError, match="density"):
        LiquidMetal(density_kg_m3=0.0)
    with pytest.raises(ValueError, match="viscosity"):
        LiquidMetal(viscosity_m2_s=-1e-6)
    with pytest.raises(ValueError, match="dimension"):
        make_kernel(1, SIZE_M)
    with pytest.raises(ValueError, match="particle size"):
        make_kernel(2, 0.0)
    with pytest.raises(ValueError, match="coefficient"):
        make_kernel(2, SIZE_M, reach=1.0)
    with pytest.raises(ValueError, match="period"):
        make_kernel(2, SIZE_M, period_m=(4 * SIZE_M, 0.0, 0.0))


def test_the_papers_tank_has_its_particles():
    tank = still_tank()
    count = [int((tank.kind == kind).sum()) for kind in (FLUID, WALL, DUMMY)]
    assert count[0] == 800
    assert count[1] + count[2] == 384
    # one layer of three: a floor of 22 between the outermost of two sides of 51
    assert count[1] == 22 + 2 * 51


def test_a_flow_too_fast_is_stopped():
    flow = small_tank(FlowGuard(speed_m_s=0.1))
    flow.particles.velocity_m_s[0, 1] = 1.0
    with pytest.raises(DivergedError, match="the limit is"):
        flow.step()


def test_a_flow_that_is_no_number_is_stopped():
    flow = small_tank()
    flow.particles.velocity_m_s[0, 1] = np.nan
    with pytest.raises(ArithmeticError):
        flow.step(1e-4)


def test_fluid_that_leaves_is_reported():
    flow = small_tank(FlowGuard(high_m=(1.0, 0.05, 1.0)))
    flow.particles.position_m[0] = (0.005, 0.06, 0.0)
    with pytest.raises(EscapedError, match="1 particles left the mould"):
        flow.step()


def test_a_crowded_region_without_surface_is_refused():
    cells = 8
    fluid = at_rest(lattice((0, 0), (cells, cells), SIZE_M), FLUID)
    fluid.position_m *= 0.94
    length_m = 0.94 * cells * SIZE_M
    kernel = make_kernel(2, SIZE_M, period_m=(length_m, length_m, 0.0))
    flow = Flow(fluid, kernel, LiquidMetal(gravity_m_s2=(0.0, 0.0, 0.0)))
    with pytest.raises(ClosedRegionError, match="without a free surface"):
        flow.step()


def test_progress_is_told_after_every_step():
    told: list[FlowProgress] = []
    flow = small_tank(scheme=Scheme(1e-3, 2))
    flow.advance(4.5e-3, progress=told.append)
    assert flow.time_s == pytest.approx(4.5e-3)
    assert len(told) == flow.cost.steps == 5
    # two relaxations and the prediction, a particle of the mould at a fifth
    mould = len(flow.fluid) - 36
    assert flow.cost.particle_solves == 5 * round(3 * (36 + 0.2 * mould))
    assert [t.percent for t in told] == sorted(t.percent for t in told)
    assert told[-1].percent == pytest.approx(100.0)
    assert told[-1].left_s == pytest.approx(0.0, abs=1e-6)
    assert all(t.particle_solves_per_s > 0.0 for t in told)


def test_steps_obey_courant_and_viscosity():
    flow = small_tank(scheme=Scheme(1.0))
    # 0.2 r0^2 / nu at rest; C_n r0 / u when moving
    assert flow.next_dt_s() == pytest.approx(0.2 * SIZE_M**2 / 1e-5)
    flow.particles.velocity_m_s[0, 0] = 0.4
    assert flow.next_dt_s() == pytest.approx(0.1 * SIZE_M / 0.4)
