"""MPS: flows with exact solutions, and what must stay what it was."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest
from scipy.spatial import cKDTree

from sandmould.casting.mps.flow import Flow
from sandmould.casting.mps.particles import Floats, make_kernel, weight
from sandmould.casting.mps.scheme import LiquidMetal, Scheme
from tests.verification.castings.flows import (
    angular_momentum_m2_s,
    channel,
    couette_m_s,
    momentum_m_s,
    poiseuille_m_s,
    rotating_patch,
    taylor_green,
    taylor_green_m_s,
)
from tests.verification.castings.moving import SETTINGS, Moved, dam_break

WIDTH_M, NU = 0.1, 1e-3
ONE_SOLVE = Scheme(1.0, 1, 1.0, source="divergence")
CONSISTENT = Scheme(
    5e-3, 1, 1.0, source="corrected_divergence", gradient="corrected", laplacian="fitted",
    surface=0.8, tension=True, shifting=0.25,
)  # fmt: skip
"""For flows without surface: models that are exact off the lattice, and a beta below the density
of all particles."""
VORTEX_REACH = 3.0
"""c_k at which the vortices converge."""


def error(got: Floats, exact: Floats) -> float:
    return float(np.sqrt(((got - exact) ** 2).mean() / (exact**2).mean()))


def couette(rows: int, scheme: Scheme = ONE_SOLVE) -> float:
    """Error of the profile while it develops, at a tenth of the time of diffusion."""
    flow = channel(rows, WIDTH_M, LiquidMetal(1000.0, NU, (0.0, 0.0, 0.0)), scheme, 0.1)
    until_s = 0.1 * WIDTH_M**2 / NU
    flow.advance(until_s)
    y = flow.particles.position_m[flow.fluid, 1]
    exact = couette_m_s(y, until_s, WIDTH_M, NU, 0.1)
    return error(flow.particles.velocity_m_s[flow.fluid, 0], exact)


def test_couette_flow_converges():
    errors = [couette(rows) for rows in (7, 15)]
    # measured 2.6 and 1.4 %: first order in the spacing, as particles slide past each other
    assert errors[0] < 0.04
    assert errors[1] < 0.75 * errors[0]


def poiseuille(rows: int, diffusions: float, scheme: Scheme = ONE_SOLVE) -> float:
    """Error of the profile after so many times of diffusion across the channel."""
    force = 8.0 * NU / WIDTH_M**2 * 0.1
    flow = channel(rows, WIDTH_M, LiquidMetal(1000.0, NU, (force, 0.0, 0.0)), scheme)
    until_s = diffusions * WIDTH_M**2 / NU
    flow.advance(until_s)
    y = flow.particles.position_m[flow.fluid, 1]
    exact = poiseuille_m_s(y, until_s, WIDTH_M, NU, force)
    return error(flow.particles.velocity_m_s[flow.fluid, 0], exact)


def test_poiseuille_flow_converges_until_its_rows_have_slid():
    errors = [poiseuille(rows, 0.02) for rows in (7, 15)]
    # measured 0.21 and 0.12 %: first order
    assert errors[0] < 0.004
    assert errors[1] < 0.75 * errors[0]


@pytest.mark.parametrize("rows", [7, 15])
def test_rows_that_slide_have_too_little_viscosity_whatever_their_number(rows):
    # Measured 1.63 and 1.56 %, 1.6 % too fast: eq. (4) is exact on a lattice alone, and what it
    # loses between rows that slide past each other does not depend on the particle size.
    assert 0.01 < poiseuille(rows, 0.1) < 0.03


def test_the_lattices_laplacian_sees_sheared_rows_with_less_viscosity():
    kernel, lost = make_kernel(2, 1.0), []
    column, row = np.meshgrid(np.arange(-8, 9), np.arange(-3, 4))
    for shift in np.linspace(0.0, 1.0, 32, endpoint=False):
        far = np.hypot(column + shift * row, row)
        near = (far > 0.0) & (far < kernel.reach_m)
        weights = np.array([weight(kernel, float(r)) for r in far[near]])
        viscosity = 2.0 / kernel.lattice_density * (weights * (row[near] / far[near]) ** 2).sum()
        lost.append(1.0 - viscosity)
    # none on the lattice, 7.4 % between, 3.7 % on average
    assert lost[0] == pytest.approx(0.0, abs=1e-9)
    assert max(lost) == pytest.approx(0.074, abs=0.001)
    assert np.mean(lost) == pytest.approx(0.037, abs=0.001)


def test_a_fitted_laplacian_converges_on_rows_that_slide():
    fitted = replace(ONE_SOLVE, laplacian="fitted")
    errors = [poiseuille(rows, 0.1, fitted) for rows in (7, 15)]
    # measured 0.062 and 0.012 %; second order would leave a quarter
    assert errors[0] < 0.001
    assert errors[1] < 0.3 * errors[0]
    # measured 0.62 and 0.24 %, where the lattice's leaves 2.5 and 1.4 %
    errors = [couette(rows, fitted) for rows in (7, 15)]
    assert errors[0] < 0.009
    assert errors[1] < 0.5 * errors[0]


def test_exact_profiles_end_in_the_steady_ones():
    y = np.linspace(0.0, WIDTH_M, 11)
    late_s = 3.0 * WIDTH_M**2 / NU
    assert couette_m_s(y, late_s, WIDTH_M, NU, 0.1) == pytest.approx(0.1 * y / WIDTH_M, abs=1e-9)
    parabola = 0.5 * 0.02 / NU * y * (WIDTH_M - y)
    assert poiseuille_m_s(y, late_s, WIDTH_M, NU, 0.02) == pytest.approx(parabola, abs=1e-9)
    assert couette_m_s(y[:-1], 1e-3, WIDTH_M, NU, 0.1) == pytest.approx(0.0, abs=0.02)


def vortices(cells: int, scheme: Scheme = CONSISTENT) -> tuple[float, float]:
    """Taylor-Green vortices after 0.15 s: loss of kinetic energy, and error of the velocity.

    The energy is taken over that of the exact field at the same places: the mean over particles
    of even the exact field is off by 2 %, since they are not spread evenly.
    """
    flow = taylor_green(cells, scheme, 0.01, reach=VORTEX_REACH)
    flow.advance(0.15)
    exact = taylor_green_m_s(flow.particles.position_m, flow.time_s, 0.01)
    got = flow.particles.velocity_m_s
    return 1.0 - float((got**2).sum() / (exact**2).sum()), error(got, exact)


def test_vortices_converge():
    loss, velocity_error = np.array([vortices(cells) for cells in (16, 24, 40)]).T
    # measured 2.4, 1.6, 0.85 % of the energy and 2.0, 1.2, 0.57 % of the velocity: orders 1.1 and
    # 1.3; the step, a tenth of the spacing over the speed, is of first order by itself
    assert loss[0] < 0.03
    assert velocity_error[0] < 0.025
    for errors in (loss, velocity_error):
        assert errors[2] < errors[1] < errors[0]
        assert math.log(errors[0] / errors[2]) / math.log(40 / 16) > 1.0


@pytest.mark.parametrize("change", [
    {"gradient": "least"}, {"gradient": "difference"}, {"source": "divergence"}, {"surface": 0.985},
])  # fmt: skip
def test_each_of_these_spoils_the_vortices(change):
    # measured 11, 8, 12 and 13 % where CONSISTENT leaves 1.6 %; against the least pressure around
    # 19 % of the energy is lost
    assert vortices(20, replace(CONSISTENT, **change))[1] > 0.04


def conserved(flow: Flow, until_s: float) -> tuple[float, float]:
    """Change of momentum over the largest speed, and relative change of angular momentum."""
    spin, fastest = angular_momentum_m2_s(flow)[2], float(flow.speed().max())
    flow.advance(until_s)
    moved = float(np.abs(momentum_m_s(flow)).max()) / fastest
    return moved, abs(float(angular_momentum_m2_s(flow)[2] / spin) - 1.0)


@pytest.mark.parametrize(
    ("gradient", "keeps"),
    [("sum", True), ("least", False), ("difference", False), ("corrected", False)],
)
def test_vortices_keep_their_momentum_where_pairs_cancel(gradient, keeps):
    flow = taylor_green(16, replace(CONSISTENT, gradient=gradient, shifting=0.0), nu=0.0)
    linear = 0.0
    for _ in range(4):
        flow.step()
        linear = max(linear, float(np.abs(momentum_m_s(flow)).max()))
    # of a largest speed of 1 m/s; round-off of 256 particles against the models' own error
    assert (linear < 1e-13) == keeps


@pytest.mark.parametrize(
    ("gradient", "keeps"),
    [("sum", True), ("difference", True), ("corrected", True), ("least", False)],
)
def test_moving_fluid_keeps_its_volume_unless_pairs_only_repel(gradient, keeps):
    scheme = Scheme(2e-3, 1, 1.0, source="divergence", gradient=gradient, tension=True)
    flow = rotating_patch(16, scheme)
    kernel, before = flow.kernel, covered_m2(flow)
    flow.advance(0.2)
    near = flow._neighbours()
    inner = near.density > 0.97 * kernel.lattice_density
    assert near.density[inner].mean() == pytest.approx(kernel.lattice_density, rel=0.03)
    # a fifth of a radian; against the least pressure around the patch grows by 7 %
    assert (abs(covered_m2(flow) / before - 1.0) < 0.03) == keeps


def covered_m2(flow: Flow) -> float:
    """Area within a spacing of a particle."""
    size_m = flow.kernel.spacing_m
    cells = np.arange(-1.0, 1.0, 0.25 * size_m)
    grid = np.stack(np.meshgrid(cells, cells), axis=-1).reshape(-1, 2)
    far, _ = cKDTree(flow.particles.position_m[:, :2]).query(grid)
    return float((far < size_m).sum() * (0.25 * size_m) ** 2)


def energy(flow: Flow) -> float:
    """Mean kinetic energy of the fluid, J/kg."""
    return 0.5 * float((flow.speed() ** 2).mean())


def test_a_rotating_patch_keeps_its_momenta():
    scheme = Scheme(5e-3, 1, 1.0, source="divergence", gradient="sum", tension=True)
    flow = rotating_patch(16, scheme)
    before = energy(flow)
    linear, angular = conserved(flow, 0.4)
    # pairs of forces along their connection cancel in both sums; what is left in the angular one
    # is the step's: velocities and positions change one after the other
    assert linear < 1e-12
    assert angular < 2e-3
    assert energy(flow) == pytest.approx(before, rel=0.02)
    # the middle of a patch that turns is under tension
    assert flow.pressure_pa.min() < 0.0


def test_a_moving_scene_is_called_by_what_is_worst():
    assert Moved("", 0.0, 0.01).word == "holds"
    assert Moved("", 0.02, 0.01).word == "noisy"
    assert Moved("", 0.02, -0.03).word == Moved("", 0.0, 0.0, lost=0.06).word == "biased"
    assert Moved("", 0.0, math.nan).word == "biased"
    assert Moved("a particle is too fast", 0.0, 0.0).word == "diverges"


@pytest.mark.slow
def test_a_dam_that_breaks_gains_no_energy_and_runs_ahead():
    it = dam_break(SETTINGS["MR5-0.5, 1 ms, collisions"])
    assert it.word == "biased"
    assert it.gained < 1e-3
    # as docs/how-to/metal_flow.md says; round-off alone moves it by a per cent or two
    assert it.off == pytest.approx(0.07, abs=0.03)
