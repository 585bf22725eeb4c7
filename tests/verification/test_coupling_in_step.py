"""The in-step scheme against exact rests and oscillations, energies, FE and the monolithic one."""

from __future__ import annotations

import math
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray

from sandmould.dem import moving_state
from sandmould.engines.program import build_program
from sandmould.engines.session import EngineStop
from sandmould.pattern_fe.coupling.contact_rows import ContactRows, shares_along
from sandmould.pattern_fe.coupling.convergence_log import CONVERGENCE_LOG, read_convergence_log
from sandmould.pattern_fe.coupling.interface import with_surface
from sandmould.pattern_fe.coupling.opening import open_coupled
from sandmould.pattern_fe.coupling.selective_mass import selective_mass
from sandmould.pattern_fe.material import Foam
from sandmould.pattern_fe.pattern import Pattern
from sandmould.pattern_fe.scene import pattern_of
from sandmould.pattern_fe.shapes import bar, mesh_of
from sandmould.pattern_fe.supports import Supports
from sandmould.runs.outcome import Outcome
from sandmould.scenario.scenario import Scenario
from tests.instep import bed_scene, in_step
from tests.patterns import _one_thread  # noqa: F401
from tests.verification.one_grain import RADIUS_M
from tests.wedge import (
    SQUEEZE_M,
    WALL_N_M,
    end_moved_m,
    end_stiffness_n_m,
    monolithic,
    plate_pattern,
    plate_scene,
    put_disc,
    rest_on_plate,
    wedge_pattern,
    wedge_scene,
)

Array = NDArray[np.float64]
ENGINES = ("reference", "lammps")


def plank_pattern(young_pa: float) -> Pattern:
    """A plank clamped at its right end, its top at the height of 15 mm."""
    mesh = mesh_of(bar(0.03, 0.005), 0.0025).translated(np.array([0.015, 0.01]))
    return Pattern(mesh, Supports(clamped=("right",)), Foam(young_pa), 2, 0.1)


@pytest.mark.parametrize("engine", ENGINES)
def test_a_plucked_plank_swings_with_its_first_frequency(engine: str, tmp_path: Path) -> None:
    pattern = plank_pattern(6.4e6)
    scenario = wedge_scene(pattern, engine={"name": engine})
    session = in_step(pattern, scenario, tmp_path)
    put_disc(session, 0.005)  # far from the plank and still
    foam, dt = session._foam, scenario.step_s
    shape = foam.mass.shape[:, 0] * 1e-6
    # of central differences, by the step: sin(turn / 2) = omega dt / 2
    turn = 2.0 * math.asin(math.pi * foam.mass.first_hz * dt)
    arrays, n = foam._arrays, len(shape)
    modal = foam.mass.scale + foam.mass.square_1_s2[0] / foam.mass.omega_1_s**2
    mass_shape = modal * pattern_mass(pattern) * shape
    arrays.displacement[:n], arrays.moved_mass[:n] = shape, mass_shape
    arrays.momentum[:n] = mass_shape * (1.0 - math.cos(turn)) / dt
    arrays.velocity[:n] = shape * (1.0 - math.cos(turn)) / dt
    for _ in range(10):
        session.advance()
        swung = shape[arrays.pressed].reshape(-1, 2) * math.cos(turn * session.steps)
        # exact but for round-off, which the small part of the stiffness in M enlarges
        np.testing.assert_allclose(session.displacement_m, swung, atol=1e-7 * np.abs(shape).max())
    assert turn * session.steps > 3.0 * 2.0 * math.pi
    session.close()


def pattern_mass(pattern: Pattern) -> Array:
    """Own mass of each component of the surface, 0 where held."""
    mass = pattern.condensed.mass_kg
    return np.where(np.isfinite(mass), mass, 0.0)


@pytest.mark.parametrize("young_pa", [2e5, 6.4e6])
def test_it_rests_where_three_springs_in_series_do(young_pa: float, tmp_path: Path) -> None:
    pattern = wedge_pattern(young_pa)
    scenario, bar_n_m = wedge_scene(pattern), end_stiffness_n_m(pattern)
    exact_m = 2 * SQUEEZE_M / (2 / WALL_N_M + 1 / bar_n_m) / bar_n_m
    session = in_step(pattern, scenario, tmp_path, damping_ratio=1.0)
    put_disc(session)
    for _ in range(20):
        session.advance()
    assert end_moved_m(session, pattern) == pytest.approx(exact_m, rel=1e-9)
    session.close()


@pytest.mark.parametrize("engine", ENGINES)
def test_a_disc_on_a_plank_bends_it_as_finite_elements_do(engine: str, tmp_path: Path) -> None:
    pattern = plank_pattern(1e6)
    scenario = wedge_scene(
        pattern,
        gravity_m_s2=9.80665,
        contact={"grain_wall": {"damping_ratio": 0.95, "friction": 0.35}},
        # a disc rocks on its friction's spring, which nothing else damps
        background_damping={"form": "nonviscous_componentwise", "nonviscous_rotation": 0.3},
        engine={"name": engine},
    )
    session = in_step(pattern, scenario, tmp_path, damping_ratio=1.0)
    session.insert_layer(1)
    place = np.array([[0.02, 0.015 + RADIUS_M]])
    session.set_state(place, np.zeros((1, 2)), np.zeros((1, 3)))
    session.start_stage(session.stage)
    for _ in range(80):
        session.advance()
    session.close()
    last = read_convergence_log(tmp_path / CONVERGENCE_LOG).iloc[-1]
    weight_n = 9.80665 * scenario.sand.grain_mass_kg(2 * RADIUS_M, 2)
    assert last.load_n == pytest.approx(weight_n, rel=1e-6)
    # the residual is that of the whole mesh under the same load
    assert last.residual_m < 1e-6 * last.displacement_m
    assert last.imbalance_n < 1e-9 * weight_n
    assert last.largest_m > 1e-6


@pytest.mark.parametrize("engine", ENGINES)
def test_its_energies_make_up_the_work_of_the_sand(engine: str, tmp_path: Path) -> None:
    pattern = wedge_pattern(6.4e6, gap_m=0.01)
    scenario = wedge_scene(pattern, damping_ratio=0.3, engine={"name": engine})
    session = in_step(pattern, scenario, tmp_path, damping_ratio=0.3)
    put_disc(session, 0.01 - RADIUS_M - 1e-5, 0.1)
    for _ in range(20):
        session.advance(1e-4)
    session.close()
    log = read_convergence_log(tmp_path / CONVERGENCE_LOG)
    assert log.damped_j.iloc[-1] > 0.01 * log.work_j.max()
    assert log.kinetic_j.max() > 0.0
    # exact for central differences; what is left is round-off of some hundred sums
    assert log.balance_j.abs().max() < 1e-11 * log.energy_j.max()


def test_a_thrown_disc_moves_the_bar_as_in_the_monolithic_scheme(tmp_path: Path) -> None:
    pattern = wedge_pattern(6.4e6, gap_m=0.01)
    wall = {"friction": 0.0, "damping_ratio": 0.0, "normal_stiffness_n_m": 2e3}
    scenario = wedge_scene(pattern, contact={"grain_wall": wall})
    ways = []
    for opened in (monolithic, in_step):
        session: Any = opened(pattern, scenario, tmp_path, damping_ratio=0.0)
        put_disc(session, 0.01 - RADIUS_M - 1e-5, 0.1)
        moved = []
        for _ in range(10):
            session.advance(4e-4)
            moved.append(end_moved_m(session, pattern))
        session.close()
        ways.append(np.array(moved))
    exact, found = ways
    # both bars swing a little, each with masses of its own: 3 % apart
    np.testing.assert_allclose(found, exact, atol=0.05 * exact.max())


@pytest.mark.parametrize("engine", ENGINES)
def test_a_plate_under_discs_rests_as_in_the_monolithic_scheme(engine: str, tmp_path: Path) -> None:
    pattern = plate_pattern()
    rests = []
    for opened, name in ((monolithic, "reference"), (in_step, engine)):
        scenario = plate_scene(pattern, engine={"name": name})
        session: Any = opened(pattern, scenario, tmp_path, damping_ratio=1.0)
        rest_on_plate(session)
        rests.append(session.displacement_m)
        session.close()
    exact, found = rests
    assert np.abs(exact).max() > 1e-7
    # both still swing a little
    np.testing.assert_allclose(found, exact, atol=1e-3 * np.abs(exact).max())


@pytest.mark.parametrize("engine", ENGINES)
def test_a_stopped_session_goes_on_as_if_never_stopped(engine: str, tmp_path: Path) -> None:
    pattern = wedge_pattern(2e5)
    scenario = wedge_scene(pattern, engine={"name": engine})
    kept = tmp_path / "kept"
    kept.mkdir()
    straight = in_step(pattern, scenario, tmp_path)
    put_disc(straight)
    straight.advance()
    straight.write_checkpoint(kept)
    straight.advance()
    straight.close()
    table = read_convergence_log(tmp_path / CONVERGENCE_LOG).drop(columns="solve_s")
    again = in_step(pattern, scenario, tmp_path, kept)
    again.advance()
    again.close()
    np.testing.assert_array_equal(again.displacement_m, straight.displacement_m)
    assert read_convergence_log(tmp_path / CONVERGENCE_LOG).drop(columns="solve_s").equals(table)


def test_threads_change_no_bit(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(moving_state, "CHUNK", 8)
    found = []
    for threads in (1, 2):
        session: Any = open_coupled(build_program(bed_scene()), tmp_path, tmp_path / "engine.log")
        session.insert_layer(1)
        session.start_stage(session.stage)
        session.advance(0.12)
        session.sand.solver._threads = threads  # also where the machine has one core
        session.advance(2e-3)
        assert len(session.sand.solver.moving.bound) > 4
        found.append(session.displacement_m)
        session.close()
    assert np.abs(found[0]).max() > 1e-5
    np.testing.assert_array_equal(*found)


@pytest.mark.parametrize("engine", ENGINES)
def test_a_bar_that_runs_away_stops_the_run(engine: str, tmp_path: Path) -> None:
    pattern = wedge_pattern(100.0)
    session = in_step(pattern, wedge_scene(pattern, engine={"name": engine}), tmp_path)
    put_disc(session, 1.2 * RADIUS_M, 60.0)
    with pytest.raises(EngineStop, match="the pattern has moved by") as stop:
        session.advance(1e-3)
    session.close()
    assert stop.value.outcome is Outcome.COUPLING_DIVERGED


def largest_growth(scenario: Scenario, pattern: Pattern, lighter: float) -> float:
    """Largest factor in a step of the pattern among still grains all round it, masses lighter."""
    surface, contacts = pattern.condensed, ContactRows.of(scenario, pattern)
    step_s = scenario.step_s
    mass = selective_mass(surface, contacts, step_s)
    inverse = lighter * mass.inverse_1_kg()
    # row_kg = dt C / 2 + dt^2 K / 4: taken as dashpots alone, which weigh more
    dashpot = 2.0 * contacts.row_kg[0] / step_s
    n, one = len(inverse), np.eye(len(inverse))
    # v' = v - dt M^-1 (S u + C v), u' = u + dt v'
    new_v = np.hstack([-step_s * inverse @ surface.stiffness_n_m, one - step_s * inverse @ dashpot])
    step = np.vstack([np.hstack([one, np.zeros((n, n))]) + step_s * new_v, new_v])
    return float(np.abs(np.linalg.eigvals(step)).max())


def test_a_row_of_grains_goes_round_the_plank_at_even_distances() -> None:
    pattern = plank_pattern(6.4e6)
    apart_m = 2 * RADIUS_M
    places = shares_along(pattern, apart_m) @ pattern.surface.vertices_m
    ways = np.linalg.norm(np.diff(places, axis=0), axis=1)
    assert len(places) == math.ceil(0.07 / apart_m)
    # shorter only across the plank's corners
    assert np.sum(np.abs(ways - apart_m) < 1e-12) >= len(ways) - 4
    contacts = ContactRows.of(wedge_scene(pattern), pattern)
    # along x and y; the scene's only size may differ by a thousandth, and so a row by one grain
    assert contacts.row_kg[0].sum() / (2.0 * contacts.one_kg) == pytest.approx(len(places), abs=1.1)


@pytest.mark.parametrize("young_pa", [1e5, 6.4e6])
def test_masses_bear_a_row_of_grains_and_half_of_them_does_not(young_pa: float) -> None:
    pattern = plank_pattern(young_pa)
    scenario = wedge_scene(pattern)
    assert largest_growth(scenario, pattern, 1.0) < 1.0 + 1e-9
    assert largest_growth(scenario, pattern, 2.0) > 1.1


def test_masses_that_need_no_help_stay_the_foams() -> None:
    pattern = plank_pattern(6.4e6)
    scenario = wedge_scene(pattern, time_step={"step_s": 1e-7})
    mass = selective_mass(pattern.condensed, ContactRows.of(scenario, pattern), 1e-7)
    assert mass.scale == 1.0
    assert mass.first_hz == pytest.approx(mass.own_first_hz, rel=0.01)
    whole = pattern.natural_frequencies_hz()[0]
    # mass shared among the vertices by area sits farther out than it is
    assert 0.9 * whole < mass.own_first_hz < whole


@pytest.mark.parametrize(("step_s", "share"), [(4e-6, 0.03), (1e-5, 0.06)])
def test_a_grain_dropped_on_a_light_cantilever_bends_it_as_energy_says(
    step_s: float, share: float, tmp_path: Path
) -> None:
    # Slopes are small: on a softer one a grain without friction slides off before the peak.
    radius_m, fall_m = 0.0021213204, 5e-4
    pattern = {
        "shape": {"kind": "bar", "width_m": 0.1, "height_m": 0.005},
        "position_m": [0.0, 0.05],
        "element_m": 0.0025,
        "supports": {"clamped": ["left"]},
        "loop": {"scheme": "in_step", "damping_ratio": 0.0},
    }
    if step_s < 5e-6:  # refused where contacts do not leave the foam its own masses
        pattern["loop"]["mass_scale"] = 1.0  # type: ignore[index]
    wall = {"normal_stiffness_n_m": 2e6, "friction": 0.0, "rolling_arm_fraction": 0.0,
            "damping_ratio": 0.0}  # fmt: skip
    at_m = [0.0975, 0.055 + radius_m + fall_m]
    scenario = with_surface(Scenario.model_validate({
        "engine": {"name": "reference"},
        "time_step": {"step_s": step_s},
        "box": {"width_m": 0.12, "height_m": 0.12},
        "sand": {"size_scale": 8, "size_classes": 1, "disc_thickness_m": 0.1},
        "contact": {"grain_wall": wall},
        "background_damping": {"form": "none"},
        "pattern": pattern,
        "fill": {"layers": [], "grains": [{"position_m": at_m, "diameter_m": 2 * radius_m}],
                 "settling": {"shortest_s": 0.05, "longest_s": 0.06}},
        "rest": {"check_every_s": 5e-4, "load_tolerance": None, "checks": 1},
    }))  # fmt: skip
    foam = pattern_of(scenario)
    vertex = np.abs(foam.surface.vertices_m - [0.0975, 0.055]).sum(axis=1).argmin()
    push = np.zeros_like(foam.surface.vertices_m)
    push[vertex, 1] = -1.0
    stiffness_n_m = -1.0 / foam.on_surface(foam.solve_linear(foam.on_nodes(push)))[vertex, 1]
    weight_n = scenario.gravity_m_s2 * scenario.sand.grain_mass_kg(2 * radius_m, 2)
    sag_m = weight_n / stiffness_n_m
    # A beam without mass: the work of the weight is in the spring. Its mass, a sixth of the
    # grain's, of which a quarter moves, takes up to 4 % of the energy of the fall, 1 % of the peak.
    exact_m = sag_m * (1.0 + math.sqrt(1.0 + 2.0 * fall_m / sag_m))
    session: Any = open_coupled(build_program(scenario), tmp_path, tmp_path / "engine.log")
    session.insert_layer(1)
    session.set_state(np.array([at_m]), np.zeros((1, 2)), np.zeros((1, 3)))
    session.start_stage(session.stage)
    lowest_m = 0.0
    while session.time_s < 0.045:
        session.advance()
        lowest_m = min(lowest_m, session.displacement_m[vertex, 1])
    session.close()
    assert -lowest_m == pytest.approx(exact_m, rel=share)
    log = read_convergence_log(tmp_path / CONVERGENCE_LOG)
    # Nothing is lost between grain and foam: round-off of the largest energy.
    assert (log["balance_j"].abs() < 1e-12 * log["work_j"].abs().max()).all()
    kept = log["first_hz"].iloc[-1] / log["own_first_hz"].iloc[-1]
    assert (kept > 0.99) == (step_s < 5e-6)
