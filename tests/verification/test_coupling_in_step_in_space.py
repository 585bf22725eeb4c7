"""A pattern stepped with the grains in 3D: rest, balances, stability; free ones and bedded ones."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest

from sandmould.pattern_fe.coupling.contact_rows import ContactRows, products_over
from sandmould.pattern_fe.coupling.convergence_log import CONVERGENCE_LOG, read_convergence_log
from sandmould.pattern_fe.coupling.explicit_foam import ContactBound
from sandmould.pattern_fe.coupling.loop_verdict import classify_loop
from sandmould.pattern_fe.coupling.selective_mass import selective_mass
from sandmould.pattern_fe.scene import pattern_of
from sandmould.scenario.scenario import Scenario
from tests.patterns import _one_thread  # noqa: F401
from tests.verification.test_coupling_in_space import opened, plank_scene

ENGINES = ("reference", "lammps")


def filled(scenario: Scenario, folder: Path) -> tuple[Any, Any, Any]:
    """Pour all layers and let them rest; give the last snapshot, wall loads and the log."""
    session = opened(scenario, folder)
    for layer in range(len(scenario.fill.each_layer())):
        session.insert_layer(layer + 1)
        session.start_stage(session.stage)
        while not session.stage_over:
            session.advance()
    snapshot, walls = session.snapshot(), session.surface_loads()
    session.close()
    return snapshot, walls, read_convergence_log(folder / CONVERGENCE_LOG)


@pytest.mark.parametrize("engine", ENGINES)
def test_the_balances_of_a_bed_on_a_plank(engine: str, tmp_path: Path) -> None:
    scenario = plank_scene(engine={"name": engine}, pattern={"loop": {"scheme": "in_step"}})
    snapshot, walls, log = filled(scenario, tmp_path)
    last = log[log.time_s > 0.25]
    masses = [scenario.sand.grain_mass_kg(2 * r, 3) for r in snapshot.radius_m]
    weight_n = scenario.gravity_m_s2 * sum(masses)
    # of floor, walls and pattern; what grains that still move a little leave
    carried_n = sum(load[2] for load in walls.values())
    assert walls["pattern"][2] == pytest.approx(snapshot.pattern_load_n[:, 2].sum(), rel=0.05)
    assert -carried_n == pytest.approx(weight_n, rel=0.05)
    assert (last.imbalance_n < 1e-9 * last.load_n).all()
    # exact for central differences; what is left is round-off of some thousand sums
    assert log.balance_j.abs().max() < 1e-9 * log.work_j.max()
    assert (last.residual_m / last.displacement_m).median() < 0.1
    verdict = classify_loop(log)
    assert verdict is not None
    assert verdict.state == "holds"


def test_a_plate_sinks_into_an_even_bed_by_its_load_over_the_springs(tmp_path: Path) -> None:
    bedding_n_m3 = 2e6
    scenario = plank_scene(
        # the plate is as wide as the box, and the walls let it slide
        contact={"grain_wall": {"friction": 0.0}},
        pattern={
            "supports": {"clamped": [], "resting": ["left", "right", "front", "back"],
                         "bedding_n_m3": bedding_n_m3},
            "loop": {"scheme": "in_step", "damping_ratio": 1.0},
            "young_modulus_pa": 6.4e6,
            "element_m": 0.03,
        },
        fill={"settling": {"shortest_s": 0.2}},
        rest={"rms_speed_m_s": 1e-3, "load_tolerance": 0.01, "checks": 3},
    )  # fmt: skip
    snapshot, _, log = filled(scenario, tmp_path)
    pattern = pattern_of(scenario)
    masses = [scenario.sand.grain_mass_kg(2 * r, 3) for r in snapshot.radius_m]
    weight_n = scenario.gravity_m_s2 * sum(masses)
    area_m2 = pattern.surface.vertex_area_m2
    sunk_m = -(snapshot.pattern_m - pattern.surface.vertices_m)[:, 2]
    # all the sand lies on it: the mean over the springs is exact, however it bends
    exact_m = weight_n / (bedding_n_m3 * area_m2.sum())
    # rest leaves a hundredth of the load
    assert sunk_m @ area_m2 / area_m2.sum() == pytest.approx(exact_m, rel=0.01)
    last = log.iloc[-1]
    assert last.load_n == pytest.approx(weight_n, rel=0.01)
    assert last.imbalance_n < 1e-9 * weight_n
    assert log.balance_j.abs().max() < 1e-9 * log.work_j.max()


def test_a_free_plate_falls_on_the_floor_and_carries_the_sand_there(tmp_path: Path) -> None:
    scenario = plank_scene(
        pattern={
            "position_m": [0.0, 0.0, 0.002],
            "supports": {"clamped": [], "free": True},
            "loop": {"scheme": "in_step", "damping_ratio": 0.5},
            "young_modulus_pa": 6.4e6,
            "element_m": 0.03,
        },
    )
    snapshot, walls, log = filled(scenario, tmp_path)
    pattern = pattern_of(scenario)
    low_m = snapshot.pattern_m[:, 2].min()
    # the sand has pushed it down by 2 mm, and it does not enter the floor
    assert low_m == pytest.approx(0.0, abs=1e-6)
    assert low_m > -1e-9
    masses = [scenario.sand.grain_mass_kg(2 * r, 3) for r in snapshot.radius_m]
    weight_n = scenario.gravity_m_s2 * sum(masses)
    last = log[log.time_s > 0.25].mean(numeric_only=True)
    # what the floor gives the plate, and takes of grains beside it and of friction at the walls
    side_n = sum(walls[name][2] for name in ("floor", "left", "right", "front", "back"))
    assert last.contact_n - side_n == pytest.approx(weight_n, rel=0.05)
    assert log.balance_j.abs().max() < 1e-9 * log.work_j.max()
    # it has kept its shape but for a tenth of the way
    assert pattern.is_free
    assert np.ptp(snapshot.pattern_m[:, 2]) == pytest.approx(0.006, rel=0.1)


def test_grains_all_round_weigh_as_many_as_lie_closest_on_its_area() -> None:
    scenario = plank_scene(pattern={"loop": {"scheme": "in_step"}})
    pattern = pattern_of(scenario)
    surface = pattern.surface
    products = products_over(surface)
    # linear shape functions sum to 1, and to the vertices' shares of the area
    np.testing.assert_allclose(products.sum(axis=1), surface.vertex_area_m2, rtol=1e-12)
    contacts = ContactRows.of(scenario, pattern)
    on_square = [
        2.0 / np.sqrt(3.0) / size.diameter_m**2
        * ContactBound.of_grain(scenario, size.diameter_m).mass_kg(scenario.step_s)
        for size in scenario.sand.classes(3)
    ]  # fmt: skip
    (row_kg,) = contacts.row_kg
    exact_kg = 3.0 * max(on_square) * surface.vertex_area_m2.sum()
    assert row_kg.sum() == pytest.approx(exact_kg, rel=1e-9)


@pytest.mark.parametrize(("lighter", "stable"), [(1.0, True), (3.0, False)])
def test_masses_bear_grains_all_round(lighter: float, stable: bool) -> None:
    scenario = plank_scene(pattern={"loop": {"scheme": "in_step"}, "element_m": 0.03})
    pattern, step_s = pattern_of(scenario), scenario.step_s
    contacts = ContactRows.of(scenario, pattern)
    mass = selective_mass(pattern.condensed, contacts, step_s)
    inverse = lighter * mass.inverse_1_kg()
    # row_kg = dt C / 2 + dt^2 K / 4: taken as dashpots alone, which weigh more
    dashpot = 2.0 * contacts.row_kg[0] / step_s
    stiffness = pattern.condensed.stiffness_n_m
    n, one = len(inverse), np.eye(len(inverse))
    new_v = np.hstack([-step_s * inverse @ stiffness, one - step_s * inverse @ dashpot])
    step = np.vstack([np.hstack([one, np.zeros((n, n))]) + step_s * new_v, new_v])
    growth = float(np.abs(np.linalg.eigvals(step)).max())
    assert (growth < 1.0 + 1e-9) == stable
