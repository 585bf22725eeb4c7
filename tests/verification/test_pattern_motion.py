"""Frequencies of the pattern, its motion in time, and its condensation to the surface."""

from __future__ import annotations

import math

import numpy as np
import pytest
from numpy.typing import NDArray
from scipy.sparse.linalg import eigsh

from sandmould.pattern_fe.condensation import CondensedSurface
from sandmould.pattern_fe.coupling.contact_rows import ContactRows
from sandmould.pattern_fe.coupling.selective_mass import selective_mass
from sandmould.pattern_fe.dynamics import as_diagonal
from sandmould.pattern_fe.material import Foam
from sandmould.pattern_fe.pattern import Pattern
from sandmould.pattern_fe.shapes import bar, mesh_of
from sandmould.pattern_fe.supports import Supports
from tests.patterns import (
    FOOT,
    KINDS,
    THICKNESS_M,
    _one_thread,  # noqa: F401
    cantilever,
    frame,
    l_pattern,
    pattern_of_kind,
)

Array = NDArray[np.float64]


def _first_mode(pattern: Pattern) -> tuple[float, Array]:
    """Angular frequency and shape of the slowest mode."""
    free = np.flatnonzero(~pattern.fixed.ravel())
    mass = as_diagonal(pattern.mass_kg, pattern.space.dimension)[free][:, free]
    square, shape = eigsh(pattern.stiffness[free][:, free], 1, mass, sigma=0.0)
    whole = np.zeros(pattern.fixed.size)
    whole[free] = shape[:, 0]
    return math.sqrt(square[0]), whole.reshape(pattern.fixed.shape)


@pytest.mark.parametrize("kind", KINDS)
@pytest.mark.parametrize("order", [1, 2])
def test_masses_have_the_weight_and_are_positive(kind: str, order: int) -> None:
    pattern = pattern_of_kind(kind, order)
    mass = 12.0 * (0.02**2 * THICKNESS_M if pattern.space.dimension == 2 else 0.02**3)
    assert pattern.mass_kg.min() > 0.0
    assert pattern.mass_kg.sum() == pytest.approx(mass)


def test_first_frequency_of_a_cantilever_is_euler_bernoullis() -> None:
    length, height = 0.2, 0.01
    pattern = cantilever(length, height, through=2, along=40, order=2, poisson=0.0)
    foam = pattern.foam
    speed = math.sqrt(foam.young_pa * height**2 / 12.0 / foam.density_kg_m3)
    exact = 1.875104**2 * speed / length**2 / (2.0 * math.pi)
    # shear and rotating sections lower it by 0.16 % at this slenderness of 20
    assert pattern.natural_frequencies_hz()[0] == pytest.approx(exact, rel=3e-3)


def test_free_bar_has_three_rigid_motions_and_then_its_bending() -> None:
    length, height, foam = 0.2, 0.01, Foam(poisson=0.0)
    mesh = mesh_of(bar(length, height), height / 2)
    pattern = Pattern(mesh, Supports(), foam, thickness_m=THICKNESS_M)
    found = pattern.natural_frequencies_hz(4)
    speed = math.sqrt(foam.young_pa * height**2 / 12.0 / foam.density_kg_m3)
    exact = 4.730041**2 * speed / length**2 / (2.0 * math.pi)
    assert found[:3].max() < 1e-3 * exact
    # shear and rotating sections lower it more than that of the cantilever: 0.9 %
    assert found[3] == pytest.approx(exact, rel=1.2e-2)


def test_number_of_frequencies_has_a_bound() -> None:
    with pytest.raises(ValueError, match="number of natural frequencies is 12, valid here is 1 to"):
        pattern_of_kind("quadrilaterals", 1).natural_frequencies_hz(12)


@pytest.mark.parametrize("kind", KINDS)
@pytest.mark.parametrize("order", [1, 2])
def test_stiffest_element_bounds_the_critical_step_closely(kind: str, order: int) -> None:
    pattern = pattern_of_kind(kind, order, Supports())
    mass = as_diagonal(pattern.mass_kg, pattern.space.dimension)
    highest = eigsh(pattern.stiffness, 1, mass, return_eigenvectors=False, tol=1e-8)[0]
    exact = 2.0 / math.sqrt(highest)
    # in 3D two to six elements share what one alone has: up to a third on the safe side
    assert 0.6 * exact < pattern.critical_step_s() <= exact * (1.0 + 1e-9)


@pytest.mark.parametrize(("share", "stable"), [(0.99, True), (1.01, False)])
def test_central_differences_are_stable_up_to_the_critical_step(share: float, stable: bool) -> None:
    pattern = l_pattern(0.015)
    free = np.flatnonzero(~pattern.fixed.ravel())
    mass = as_diagonal(pattern.mass_kg, 2)[free][:, free]
    highest = eigsh(pattern.stiffness[free][:, free], 1, mass, return_eigenvectors=False)[0]
    motion = pattern.central_differences(share * 2.0 / math.sqrt(highest))
    motion.displacement_m[~pattern.fixed] = np.random.default_rng(1).standard_normal(len(free))
    for _ in range(400):
        motion.advance(np.zeros_like(motion.displacement_m))
    largest = np.abs(motion.displacement_m).max()
    # beyond it the highest mode grows 1.3 times a step
    assert largest < 100.0 if stable else largest > 1e10
    assert not motion.displacement_m[pattern.fixed].any()


def test_damped_central_differences_come_to_rest_in_equilibrium() -> None:
    pattern = cantilever(0.05, 0.01, through=1, along=3, order=2)
    load = np.zeros_like(pattern.space.node_m)
    load[:, 1] = -3.0
    damping = 2.0 * _first_mode(pattern)[0]
    step_s = 0.8 * 4.0 * pattern.critical_step_s()
    motion = pattern.central_differences(step_s, damping / 4.0, mass_scale=16.0)
    for _ in range(1500):
        motion.advance(load)
    rest = pattern.solve_linear(load)
    # critically damped over five periods: what is left is below a thousandth
    assert np.abs(motion.displacement_m - rest).max() < 1e-3 * np.abs(rest).max()


def test_mass_damping_lets_a_mode_decay_at_its_rate() -> None:
    pattern = l_pattern(0.015)
    omega, shape = _first_mode(pattern)
    damping = 0.2 * omega
    period = 2.0 * math.pi / math.sqrt(omega**2 - damping**2 / 4.0)
    steps = math.ceil(period / pattern.critical_step_s())
    motion = pattern.central_differences(period / steps, damping)
    # velocities live half a step early: this one starts the mode at rest
    motion.velocity_m_s = 0.5 * period / steps * omega**2 * shape
    motion.displacement_m = shape
    for _ in range(steps):
        motion.advance(np.zeros_like(shape))
    share = np.sum(motion.displacement_m * shape) / np.sum(shape**2)
    # a whole damped period later only the decay is seen, to the second order in the step
    assert share == pytest.approx(math.exp(-damping * period / 2.0), rel=2e-3)


def test_an_impossible_scale_of_masses_is_refused() -> None:
    pattern = pattern_of_kind("quadrilaterals", 1)
    with pytest.raises(ValueError, match="mass scale of the pattern is 0, valid is above 0"):
        selective_mass(pattern.condensed, ContactRows((), 0.0), 1e-6, scale=0.0)


def _patterns_to_condense() -> list[Pattern]:
    hollow = Pattern(mesh_of(frame(0.01, 0.04, 0.05), 0.01), FOOT, thickness_m=THICKNESS_M)
    bedded = Supports(bedding_n_m3=1e6)
    cube = pattern_of_kind("hexahedra", 1)
    return [l_pattern(), hollow, cube, *(pattern_of_kind(kind, 2, bedded) for kind in KINDS)]


def _free_solution(surface: CondensedSurface, load_n: Array) -> Array:
    """Of the nodes on the surface under loads on its vertices, (n,) float64, m."""
    free = ~surface.fixed
    found = np.zeros(len(free))
    part = surface.stiffness_n_m[np.ix_(free, free)]
    found[free] = np.linalg.solve(part, (surface.motion.T @ load_n.ravel())[free])
    return found


def test_condensed_surface_answers_loads_on_it_as_the_whole_pattern() -> None:
    for pattern in _patterns_to_condense():
        load = np.random.default_rng(8).standard_normal(pattern.surface.vertices_m.shape)
        whole = pattern.on_surface(pattern.solve_linear(pattern.on_nodes(load)))
        condensed = pattern.condensed.motion @ _free_solution(pattern.condensed, load)
        assert np.allclose(condensed, whole.ravel(), rtol=0.0, atol=1e-10 * np.abs(whole).max())


def test_condensed_rows_of_held_components_give_the_reactions() -> None:
    pattern = l_pattern()
    surface = pattern.condensed
    load = np.random.default_rng(8).standard_normal(pattern.surface.vertices_m.shape)
    # what loads put on held nodes goes straight into the supports
    at_nodes = surface.motion.T @ load.ravel()
    force = surface.stiffness_n_m @ _free_solution(surface, load)
    reaction = np.where(surface.fixed, force - at_nodes, 0.0).reshape(-1, 2)
    assert np.allclose(reaction.sum(axis=0), -load.sum(axis=0), rtol=0.0, atol=1e-8)


def test_condensed_mass_is_the_patterns_and_held_components_are_in_no_mode() -> None:
    pattern = l_pattern()
    surface = pattern.condensed
    held = pattern.surface.held(pattern.fixed).ravel()
    assert (np.isinf(surface.mass_kg) == held).all()
    free = Pattern(pattern.space.mesh, Supports(), thickness_m=THICKNESS_M).condensed
    assert free.mass_kg.reshape(-1, 2).sum(axis=0) == pytest.approx(pattern.mass_kg.sum())
    square, shape = surface.modes
    assert not shape[held].any()
    mass = np.where(held, 0.0, surface.mass_kg)
    np.testing.assert_allclose(shape.T @ (mass[:, None] * shape), np.eye(len(square)), atol=1e-9)
    of_nodes = np.linalg.lstsq(surface.motion, shape, rcond=None)[0]
    bent = of_nodes.T @ surface.stiffness_n_m @ of_nodes
    np.testing.assert_allclose(bent, np.diag(square), atol=1e-9 * square[-1])


def test_condensed_frequency_is_a_little_low() -> None:
    pattern = l_pattern()
    square, _ = pattern.condensed.modes
    first = pattern.natural_frequencies_hz()[0]
    # mass shared by area sits farther out than it is: 7 % low in this L
    assert math.sqrt(square[0]) / (2.0 * math.pi) == pytest.approx(0.93 * first, rel=0.01)
