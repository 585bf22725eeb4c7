"""Critical steps of contact networks against frequencies worked out by hand."""

from __future__ import annotations

import math

import numpy as np
import pytest

from sandmould.dem.contact_law import Law
from sandmould.dem.critical_step import active_contacts, whole_step
from sandmould.dem.grains import Grains
from sandmould.dem.motion import NONE, Damping
from sandmould.dem.solver import Solver
from sandmould.dem.steps import DemScene
from sandmould.dem.surfaces import Surfaces
from tests.verification.grain_limits import grain_step, simplified_step

K_N_M = 7e4
MASS_KG = 2e-3
RADIUS_M = 1e-3
UNIT_RAD_S = math.sqrt(K_N_M / MASS_KG)
OVERLAP = 1e-9
"""Overlap over the radius, so small that the arms are the radii."""
SMOOTH = Law(K_N_M, K_N_M, 0.0, 0.0, 0.0, K_N_M, True, False)
ROUGH = SMOOTH._replace(friction=0.5)
ALL_STEPS = (simplified_step, grain_step, whole_step)


def network(positions: list[list[float]] | np.ndarray, law: Law, floor: bool = False) -> Solver:
    """Equal grains placed at positions in radii, less an overlap; a floor at height 0."""
    position = np.array(positions, dtype=float) * RADIUS_M * (1 - OVERLAP)
    n, d = position.shape
    surfaces = Surfaces(d)
    if floor:
        surfaces.add_plane("floor", np.zeros(d), np.eye(d)[-1])
    up = (0.0,) * (d - 1) + (1.0,)
    damping = Damping(NONE, 0.0, 0.0)
    solver = Solver(DemScene(law, law, damping, (0.0,) * d, up, True, 1e-9), surfaces, RADIUS_M)
    spin, mass = np.zeros((n, 1 if d == 2 else 3)), np.full(n, MASS_KG)
    inertia = (0.5 if d == 2 else 0.4) * mass * RADIUS_M**2
    still = np.zeros_like(position)
    ids = np.arange(1, n + 1)
    radius = np.full(n, RADIUS_M)
    solver.add(Grains.of(ids, position, still, spin, radius, mass, inertia))
    solver.place(position, still, spin)
    return solver


def squares(solver: Solver) -> list[float]:
    """Highest squared frequencies of the three estimates, in units of k / m."""
    contacts = active_contacts(solver)
    return [(step(contacts).omega_rad_s / UNIT_RAD_S) ** 2 for step in ALL_STEPS]


def damped(omega: float, xi: float) -> float:
    """Eq. (42) for a frequency in units of sqrt(k / m)."""
    return 2 / (omega * UNIT_RAD_S) * (math.sqrt(1 + xi**2) - xi)


@pytest.mark.parametrize("zeta", [0.0, 0.3, 1.0])
def test_smooth_grain_on_a_wall_is_the_oscillator_of_the_paper(zeta: float) -> None:
    contacts = active_contacts(network([[0, 1]], SMOOTH._replace(damping_ratio=zeta), floor=True))
    for step in ALL_STEPS:
        found = step(contacts)
        assert found.omega_rad_s == pytest.approx(UNIT_RAD_S)
        assert found.undamped_s == pytest.approx(2 / UNIT_RAD_S)
        assert found.damped_s == pytest.approx(damped(1.0, zeta))


@pytest.mark.parametrize(("place", "inertia"), [([0, 1], 0.5), ([0, 0, 1], 0.4)])
def test_rough_grain_on_a_wall_rolls_faster_than_it_turns(place: list[int], inertia: float) -> None:
    # Held at its centre it turns with k_T / (c m), (54); free to roll, translation adds k_T / m.
    estimate, grain, whole = squares(network([place], ROUGH, floor=True))
    assert estimate == pytest.approx(1 / inertia)
    assert grain == pytest.approx(1 + 1 / inertia)
    assert whole == pytest.approx(1 + 1 / inertia)


def test_two_smooth_grains_swing_with_the_mass_of_eq_21() -> None:
    assert squares(network([[0, 0], [2, 0]], SMOOTH)) == pytest.approx([1, 1, 2])
    contacts = active_contacts(network([[0, 0], [2, 0]], SMOOTH._replace(damping_ratio=0.4)))
    assert whole_step(contacts).damped_s == pytest.approx(damped(math.sqrt(2), 0.4))
    # Held, a grain has half the effective inverse mass: xi = c / (2 m omega) = 0.4 / sqrt(2).
    assert grain_step(contacts).damped_s == pytest.approx(damped(1, 0.4 / math.sqrt(2)))


def test_rough_pair_adds_the_rolling_spring() -> None:
    # Antisymmetric: both turn alike and slide past each other, (1 + 1/c) 2 k_T / m = 6 k_T / m.
    assert squares(network([[0, 0], [2, 0]], ROUGH))[2] == pytest.approx(6)
    # Turned against each other, only the rolling spring at r / 2 holds them: 2 k (r/2)^2 / I.
    stiff = ROUGH._replace(rolling_arm=0.1, k_roll=100 * K_N_M)
    assert squares(network([[0, 0], [2, 0]], stiff))[2] == pytest.approx(100 * 2 / 4 / 0.5)


@pytest.mark.parametrize(("torsion", "motions"), [(False, 3), (True, 4)])
def test_torsion_is_held_only_where_the_law_says_so(torsion: bool, motions: int) -> None:
    law = SMOOTH._replace(rolling_arm=0.1, k_roll=1000 * K_N_M, torsion=torsion)
    solver = network([[0, 0, 1]], law, floor=True)
    # The sphere rolls on springs of k_roll r^2 and is pressed: two or three turns, one way.
    assert squares(solver)[2] == pytest.approx(1000 / 0.4)
    assert np.linalg.matrix_rank(active_contacts(solver).rows_first[0]) == motions


@pytest.mark.parametrize("n", [2, 5, 12, 90])
def test_chain_on_a_wall_has_its_exact_frequency(n: int) -> None:
    column = [[0, 2 * i + 1] for i in range(n)]
    exact = 2 * math.sin((2 * n - 1) / (2 * n + 1) * math.pi / 2)
    estimate, grain, whole = squares(network(column, SMOOTH, floor=True))
    assert whole == pytest.approx(exact**2)
    assert estimate == pytest.approx(2)
    assert grain == pytest.approx(2)


def test_free_damped_chain_follows_eq_42_with_the_damping_of_its_highest_mode() -> None:
    n, zeta = 7, 0.6
    law = SMOOTH._replace(damping_ratio=zeta)
    found = whole_step(active_contacts(network([[2 * i, 0] for i in range(n)], law)))
    omega = 2 * math.sin((n - 1) * math.pi / (2 * n))
    # C = 2 zeta sqrt(m / (2 k)) K: the fraction grows with the frequency of the mode.
    assert found.omega_rad_s == pytest.approx(omega * UNIT_RAD_S)
    assert found.damped_s == pytest.approx(damped(omega, zeta * omega / math.sqrt(2)))


def hexagons(across: int) -> np.ndarray:
    """Lattice positions in radii, touching."""
    row, column = np.divmod(np.arange(across**2), across)
    return np.column_stack([2.0 * column + row % 2, math.sqrt(3) * row])


def test_hexagonal_patch_tends_to_the_lattice() -> None:
    estimate, grain, whole = squares(network(hexagons(16), SMOOTH))
    assert estimate == pytest.approx(6)
    assert grain == pytest.approx(3)
    # The highest mode of the endless lattice has 6 k / m; a patch comes near from below.
    assert 5.8 < whole < 6
    # Rough and endless, all turn alike with 2 x 6 k_T r^2 / I = 24 k_T / m.
    assert 22.5 < squares(network(hexagons(16), ROUGH))[2] < 24


def test_estimates_bound_each_other_in_a_random_heap() -> None:
    rng = np.random.default_rng(5)
    for dimension in (2, 3):
        place = rng.uniform(0.5, 9, (60, dimension))
        for zeta in (0.0, 0.5):
            law = ROUGH._replace(damping_ratio=zeta, rolling_arm=0.1, torsion=True)
            contacts = active_contacts(network(place, law, floor=True))
            grain, whole = grain_step(contacts), whole_step(contacts)
            assert grain.omega_rad_s <= whole.omega_rad_s <= math.sqrt(2) * grain.omega_rad_s
            assert grain.damped_s / 2 <= whole.damped_s <= grain.damped_s
            assert whole.damped_s <= whole.undamped_s * (1 + 1e-12)


def test_grains_that_touch_nothing_allow_any_step() -> None:
    contacts = active_contacts(network([[0, 5], [9, 5]], SMOOTH, floor=True))
    for step in ALL_STEPS:
        found = step(contacts)
        assert (found.omega_rad_s, found.undamped_s, found.damped_s) == (0, math.inf, math.inf)


@pytest.mark.parametrize("zeta", [0.3, 1.0])
def test_corrected_dashpots_bear_the_step_that_they_are_found_for(zeta: float) -> None:
    law = SMOOTH._replace(damping_ratio=zeta, lag_s=1e-9)
    contacts = active_contacts(network([[0, 1]], law, floor=True))
    for step in ALL_STEPS:
        h = step(contacts).damped_s * UNIT_RAD_S
        # c' = c / (1 + c dt / (4 m)) with c dt / m = 2 zeta h, put into (42).
        assert h**2 + 4 * zeta * h / (1 + zeta * h / 2) == pytest.approx(4)
        assert h * (1 + 1e-9) > damped(1.0, zeta) * UNIT_RAD_S * (1 + 0.1 * zeta)
