"""The monolithic scheme against exact rests and its own energies, and the staggered loop beside."""

from __future__ import annotations

import re
from itertools import pairwise
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray

from sandmould.engines.program import build_program
from sandmould.engines.session import EngineStop
from sandmould.pattern_fe.coupling.convergence_log import CONVERGENCE_LOG, read_convergence_log
from sandmould.pattern_fe.coupling.explicit_foam import ContactBound, ExplicitFoam
from sandmould.pattern_fe.coupling.interface import with_surface
from sandmould.pattern_fe.coupling.opening import open_coupled
from sandmould.runs.outcome import Outcome
from tests.patterns import _one_thread  # noqa: F401
from tests.verification.one_grain import RADIUS_M, one_grain_scene
from tests.wedge import (
    DISCS,
    SQUEEZE_M,
    WALL_N_M,
    end_moved_m,
    end_stiffness_n_m,
    monolithic,
    plate_pattern,
    plate_scene,
    put_disc,
    rest_on_plate,
    staggered,
    wedge_pattern,
    wedge_scene,
)

Array = NDArray[np.float64]


@pytest.mark.parametrize("young_pa", [2e5, 6.4e6])
def test_monolithic_and_staggered_loop_rest_where_three_springs_in_series_do(
    young_pa: float, tmp_path: Path
) -> None:
    pattern = wedge_pattern(young_pa)
    scenario, bar_n_m = wedge_scene(pattern), end_stiffness_n_m(pattern)
    exact_m = 2 * SQUEEZE_M / (2 / WALL_N_M + 1 / bar_n_m) / bar_n_m
    explicit: Any = monolithic(pattern, scenario, tmp_path, damping_ratio=1.0)
    for session in (explicit, staggered(pattern, scenario, tmp_path)):
        put_disc(session)
        for _ in range(20):
            session.advance()
        # one is at rest to round-off, the loop still comes closer by a digit a record
        assert end_moved_m(session, pattern) == pytest.approx(exact_m, rel=1e-6)
        session.close()


def test_a_thrown_disc_leaves_a_part_of_its_energy_in_a_soft_bar(tmp_path: Path) -> None:
    pattern = wedge_pattern(2e5, gap_m=0.01)
    # dashpots of contacts would take energy
    scenario = wedge_scene(pattern, damping_ratio=0.0)
    session = monolithic(pattern, scenario, tmp_path, damping_ratio=0.0)
    put_disc(session, 0.01 - RADIUS_M - 1e-5, 0.1)
    session.advance(5e-3)
    left_m_s = session.snapshot().velocity_m_s[0]
    session.close()
    last = read_convergence_log(tmp_path / CONVERGENCE_LOG).iloc[-1]
    assert last.load_n == 0.0
    assert left_m_s[0] < 0.0
    half_mass_kg = 0.5 * scenario.sand.grain_mass_kg(2 * RADIUS_M, 2)
    stored_j = last.elastic_j + last.kinetic_j
    before_j = half_mass_kg * 0.1**2
    # the spring of the contact is worked on at steps, its energy lost or won is of (omega dt)^2
    assert half_mass_kg * (left_m_s @ left_m_s) + stored_j == pytest.approx(before_j, rel=1e-3)
    assert stored_j > 0.01 * before_j


@pytest.mark.parametrize("mass_scale", [None, 1.0])
def test_the_bars_energies_make_up_the_work_of_the_sand(
    mass_scale: float | None, tmp_path: Path
) -> None:
    pattern = wedge_pattern(6.4e6, gap_m=0.01)
    scenario = wedge_scene(pattern, damping_ratio=0.0)
    session = monolithic(pattern, scenario, tmp_path, mass_scale=mass_scale, damping_ratio=0.3)
    assert (session._foam.sub_steps > 1) == (mass_scale == 1.0)
    put_disc(session, 0.01 - RADIUS_M - 1e-5, 0.1)
    for _ in range(20):
        session.advance(1e-4)
    session.close()
    log = read_convergence_log(tmp_path / CONVERGENCE_LOG)
    assert log.damped_j.iloc[-1] > 0.01 * log.work_j.max()
    # exact for central differences; what is left is round-off of some thousand sums
    assert log.balance_j.abs().max() < 1e-12 * log.elastic_j.max()


def test_smaller_windows_lead_the_staggered_loop_to_the_monolithic_scheme(tmp_path: Path) -> None:
    pattern = wedge_pattern(6.4e6, gap_m=0.01)
    wall = {"friction": 0.0, "damping_ratio": 0.0, "normal_stiffness_n_m": 2e3}
    scenario = wedge_scene(pattern, contact={"grain_wall": wall})

    def way_m(session: Any) -> Array:
        put_disc(session, 0.01 - RADIUS_M - 1e-5, 0.1)
        moved = []
        for _ in range(10):
            session.advance(4e-4)
            moved.append(end_moved_m(session, pattern))
        session.close()
        return np.array(moved)

    explicit = way_m(monolithic(pattern, scenario, tmp_path, damping_ratio=0.0))
    errors = []
    for window_s in (4e-4, 2e-4, 1e-4, 5e-5):
        loop = staggered(pattern, scenario, tmp_path, window_s=window_s, repeats=20, tolerance=1e-6)
        errors.append(np.abs(way_m(loop) - explicit).max() / explicit.max())
    # The mean load of a window is half a window old: of first order. The monolithic scheme's bar
    # has masses and swings by some thousandths, which the last window begins to feel.
    assert all(after < 0.6 * before for before, after in pairwise(errors))
    assert errors[-1] < 0.01


def test_a_plate_on_springs_carries_its_discs_where_their_weight_says(tmp_path: Path) -> None:
    pattern = plate_pattern()
    scenario = plate_scene(pattern)
    weight_n = DISCS * 9.80665 * scenario.sand.grain_mass_kg(2 * RADIUS_M, 2)
    springs_n_m = pattern.supports.bedding_n_m3 * pattern.surface.vertex_area_m2
    springs_n_m = springs_n_m[pattern.surface.outer_line]
    explicit: Any = monolithic(pattern, scenario, tmp_path, damping_ratio=1.0)
    for session in (explicit, staggered(pattern, scenario, tmp_path, scheme="aitken")):
        rest_on_plate(session)
        # however the plate bends, its springs carry the weight; the loop still creeps towards it
        assert -springs_n_m @ session.displacement_m[:, 1] == pytest.approx(weight_n, rel=1e-3)
        session.close()


def test_a_stopped_monolithic_run_goes_on_bit_for_bit(tmp_path: Path) -> None:
    pattern = wedge_pattern(2e5)
    scenario = wedge_scene(pattern)
    kept = tmp_path / "kept"
    kept.mkdir()
    straight = monolithic(pattern, scenario, tmp_path)
    put_disc(straight)
    straight.advance()
    straight.write_checkpoint(kept)
    straight.advance()
    straight.close()
    table = (tmp_path / CONVERGENCE_LOG).read_bytes()
    again = monolithic(pattern, scenario, tmp_path, kept)
    again.advance()
    again.close()
    np.testing.assert_array_equal(again.displacement_m, straight.displacement_m)
    assert (tmp_path / CONVERGENCE_LOG).read_bytes() == table


def test_a_bar_that_runs_away_stops_the_run(tmp_path: Path) -> None:
    pattern = wedge_pattern(100.0)
    session = monolithic(pattern, wedge_scene(pattern), tmp_path)
    put_disc(session, RADIUS_M + 0.2 * RADIUS_M, 60.0)
    with pytest.raises(EngineStop, match="the pattern has moved by") as stop:
        session.advance(1e-3)
    assert stop.value.outcome is Outcome.COUPLING_DIVERGED


def test_masses_that_contacts_would_throw_are_told() -> None:
    pattern = wedge_pattern(2e5)
    scenario = wedge_scene(pattern)
    bound = ContactBound.of(scenario, pattern)
    with pytest.raises(ValueError, match="mass scale of the pattern is 1, valid is above"):
        ExplicitFoam(pattern, scenario.step_s, bound, mass_scale=1.0)


@pytest.mark.parametrize(
    ("scheme", "log", "says"),
    [
        ("monolithic", "engine.log", r"masses times \d.*, first frequency \d"),
        ("in_step", "pattern.log", r"own masses times 1.* and stiffness .*, first\s+frequency \d"),
    ],
)
def test_a_scenario_opens_a_scheme_whose_log_tells_of_the_masses(
    scheme: str, log: str, says: str, tmp_path: Path
) -> None:
    told = {
        "shape": {"kind": "bar", "width_m": 0.01, "height_m": 0.01},
        "position_m": [0.02, 0.0],
        "loop": {"scheme": scheme},
    }
    scenario = with_surface(one_grain_scene(pattern=told, engine={"name": "reference"}))
    session = open_coupled(build_program(scenario), tmp_path, tmp_path / "engine.log")
    session.insert_layer(1)
    session.start_stage(session.stage)
    session.advance()
    snapshot = session.snapshot()
    session.close()
    assert snapshot.pattern_m is not None
    assert re.search(says, (tmp_path / log).read_text())
