"""MPS: the Poisson system, its solver, and regions without a free surface."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.sparse import csr_array, eye_array
from scipy.sparse.linalg import spsolve

from sandmould.casting.mps.neighbours import Neighbours, find_candidates, find_neighbours
from sandmould.casting.mps.particles import (
    DUMMY,
    FLUID,
    Kernel,
    Particles,
    at_rest,
    lattice,
    make_kernel,
)
from sandmould.casting.mps.pressure import Rows, assemble, solve_pressure
from sandmould.casting.mps.scene import still_tank

SIZE_M = 2e-3


def near_in(kernel: Kernel, particles: Particles) -> Neighbours:
    listed = find_candidates(kernel, particles.position_m, particles.kind)
    return find_neighbours(kernel, listed, particles.position_m, particles.kind)


def matrix_of(rows: Rows) -> csr_array:
    """Minus the Laplacian, scaled."""
    m, part = len(rows.number), rows.system
    return csr_array((part.value, part.column, part.start), shape=(m, m)) + eye_array(m)


def test_solution_is_that_of_a_direct_solver():
    kernel, tank = make_kernel(2, SIZE_M), still_tank(8, 10)
    near = near_in(kernel, tank)
    surface = near.density < 0.985 * kernel.lattice_density
    rows = assemble(kernel, near, tank.kind, surface)
    matrix = matrix_of(rows)
    assert abs(matrix - matrix.T).max() < 1e-14
    assert not rows.closed.any()
    source = np.random.default_rng(2).normal(size=len(tank.kind))
    direct = rows.scale * spsolve(matrix.tocsc(), rows.scale * source[rows.number])
    asked = (kernel, near, tank.kind, surface, source)
    pressure, iterations = solve_pressure(*asked, 0 * source, 1e-10)
    # the residual is 1e-10 of the source; the condition number is about 1000
    assert pressure[rows.number] == pytest.approx(direct, abs=1e-6 * np.abs(direct).max())
    assert 5 < iterations < len(direct)
    assert not pressure[surface | (tank.kind == DUMMY)].any()
    # a close guess spares iterations, one worse than nothing is not taken
    assert solve_pressure(*asked, pressure, 1e-8)[1] == 0
    assert 0 < solve_pressure(*asked, 0.99 * pressure, 1e-10)[1] < iterations
    assert solve_pressure(*asked, 1e3 * pressure[::-1], 1e-10)[1] == iterations


def test_a_uniform_source_makes_the_pressure_of_a_column():
    """Lap p = -s in a strip with p = 0 on top: p = s (H y - y^2/2)."""
    cells, columns, source = 20, 6, 1e6
    place = lattice((0, 0), (columns, cells), SIZE_M)
    kernel = make_kernel(2, SIZE_M, period_m=(columns * SIZE_M, 0.0, 0.0))
    strip = at_rest(place, FLUID)
    near = near_in(kernel, strip)
    height = strip.position_m[:, 1]
    # the lowest row has nothing under it: no flux, as at a wall
    surface = height > (cells - 2) * SIZE_M
    pressure, _ = solve_pressure(
        kernel, near, strip.kind, surface, np.full(len(height), source), 0 * height, 1e-8
    )
    depth = height[surface].min() - 0.5 * SIZE_M
    exact = 0.5 * source * (depth**2 - height**2)
    inner = ~surface
    # the cut kernel at the wall and two rows of zero pressure displace the ends by half a row each
    assert pressure[inner] == pytest.approx(exact[inner], abs=0.06 * exact.max())


def test_a_region_without_surface_has_its_least_pressure_at_zero():
    cells = 10
    length_m = cells * SIZE_M
    kernel = make_kernel(2, SIZE_M, period_m=(length_m, length_m, 0.0))
    fluid = at_rest(lattice((0, 0), (cells, cells), SIZE_M), FLUID)
    near = near_in(kernel, fluid)
    x = 2 * np.pi * fluid.position_m[:, 0] / length_m
    surface = np.zeros(cells**2, dtype=bool)
    # the constant part of the source cannot be met and is left out
    source = 1000.0 * np.cos(x) + 300.0
    pressure, _ = solve_pressure(kernel, near, fluid.kind, surface, source, 0 * source, 1e-8)
    assert pressure.min() == 0.0
    wave = pressure - pressure.mean()
    exact = 1000.0 * (length_m / (2 * np.pi)) ** 2 * np.cos(x)
    # ten particles a wave: the Laplacian is short of (2 pi/10)^2/12 and more for its wide kernel
    assert wave == pytest.approx(exact, abs=0.08 * exact.max())
