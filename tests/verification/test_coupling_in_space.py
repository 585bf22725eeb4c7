"""The staggered loop in 3D: conserved loads, a grain on a cantilever, a bed on a plank."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest

from sandmould.engines.program import build_program
from sandmould.engines.registry import engine_of
from sandmould.pattern_fe.coupling.convergence_log import CONVERGENCE_LOG, read_convergence_log
from sandmould.pattern_fe.coupling.foam_body import cross
from sandmould.pattern_fe.coupling.interface import with_surface
from sandmould.pattern_fe.coupling.loop_verdict import classify_loop
from sandmould.pattern_fe.coupling.opening import open_coupled
from sandmould.pattern_fe.pattern import Pattern
from sandmould.pattern_fe.scene import pattern_of
from sandmould.scenario.reading import Origin, merge
from sandmould.scenario.scenario import Scenario
from tests.patterns import _one_thread  # noqa: F401
from tests.verification.one_grain import RADIUS_M, one_grain_scene

ENGINES = ("reference", "lammps")
TOP_M = 0.015
SOFT = {"normal_stiffness_n_m": 500.0, "tangential_stiffness_n_m": 500.0}


def cantilever_scene(**changes: Any) -> Scenario:
    """One grain over a stiff bar of foam that is clamped at its right end."""
    scene: dict[str, Any] = {
        "dimension": 3,
        "box": {"width_m": 0.05, "depth_m": 0.02, "height_m": 0.05},
        "contact": {
            "grain_grain": SOFT,
            "grain_wall": SOFT | {"friction": 0.35},
            "springs_at_size_scale": None,
        },
        "background_damping": {"form": "nonviscous_componentwise", "nonviscous_rotation": 0.3},
        "pattern": {
            "shape": {"kind": "bar", "width_m": 0.03, "height_m": 0.005},
            "position_m": [0.02, 0.006, TOP_M - 0.005],
            "depth_m": 0.008,
            "element_m": 0.005,
            "young_modulus_pa": 1e8,
            "supports": {"clamped": ["right"]},
            "loop": {"scheme": "fixed", "factor": 0.4},
        },
        "time_step": {"fraction": 0.2},
        "fill": {"layers": [{"count": 1}], "settling": {"shortest_s": 1.9}},
        "rest": {"load_every_steps": 1, "check_every_s": 2e-3},
        "engine": {"name": "reference"},
    }
    told = one_grain_scene().model_dump(mode="json", exclude_unset=True)
    return changed(merge(told, scene, Origin(), "test"), changes)


def changed(scene: dict[str, Any], changes: dict[str, Any]) -> Scenario:
    tree = merge(scene, changes, Origin(), "test")
    return with_surface(Scenario.model_validate(tree))


def opened(scenario: Scenario, folder: Path) -> Any:
    program = build_program(scenario)
    engine_of(scenario).write_deck(program, {}, folder, "test", "test")
    return open_coupled(program, folder, folder / "engine.log")


def put_sphere(session: Any, place_m: list[float], speed_m_s: list[float]) -> None:
    session.insert_layer(1)
    session.set_state(np.array([place_m]), np.array([speed_m_s]), np.zeros((1, 3)))
    session.start_stage(session.stage)


def test_vertices_carry_force_and_moment_of_contacts(tmp_path: Path) -> None:
    frictional = {"friction": 0.35, "rolling_arm_fraction": 0.0, "damping_ratio": 0.3}
    scenario = cantilever_scene(
        gravity_m_s2=0.0,
        contact={"grain_wall": SOFT | frictional},
        background_damping={"form": "none"},
        fill={"layers": [{"count": 1}]},
    )
    session = opened(scenario, tmp_path).sand
    # over the edge between two triangles of the upper face, sliding and pressed in
    put_sphere(session, [0.0312, 0.0093, TOP_M + RADIUS_M - 1e-4], [0.05, -0.02, -0.01])
    vertices_m = scenario.scene.meshes[0].vertices_m
    forces = []
    for _ in range(30):
        session.advance(session.step_s)
        load, grains = session.vertex_loads("pattern"), session.solver.grains
        force, place = grains.force[0].copy(), grains.position[0]
        scale = np.abs(force).max()
        np.testing.assert_allclose(-load.sum(axis=0), force, rtol=0.0, atol=1e-10 * scale)
        moment = cross(vertices_m, load).sum(axis=0)
        by_grain = np.cross(place, force) + grains.moment[0]
        arm_m = np.abs(vertices_m).max()
        np.testing.assert_allclose(-moment, by_grain, rtol=0.0, atol=1e-10 * scale * arm_m)
        forces.append(force)
    pressed = max(forces, key=lambda force: float(force[2]))
    assert pressed[2] > 0.04
    assert max(abs(force[0]) for force in forces) > 0.1 * pressed[2]
    session.close()


@pytest.mark.slow
@pytest.mark.parametrize("engine", ENGINES)
def test_a_grain_on_a_cantilever_bends_it_as_a_point_load_does(engine: str, tmp_path: Path) -> None:
    scenario = cantilever_scene(engine={"name": engine})
    session, place = opened(scenario, tmp_path), [0.0226, 0.0113, TOP_M + RADIUS_M]
    put_sphere(session, place, [0.0, 0.0, 0.0])
    for _ in range(60):
        session.advance()
    session.close()
    pattern = pattern_of(scenario)
    weight_n = scenario.gravity_m_s2 * scenario.sand.grain_mass_kg(2 * RADIUS_M, 3)
    exact_m = under_point_load(pattern, np.array([*place[:2], TOP_M]), weight_n)
    # the grain lies still but for round-off of its friction's spring and what is left to sink
    largest_m = np.abs(exact_m).max()
    np.testing.assert_allclose(session.displacement_m, exact_m, rtol=0.0, atol=1e-4 * largest_m)
    assert largest_m > 1e-7
    last = read_convergence_log(tmp_path / CONVERGENCE_LOG).iloc[-1]
    assert last.load_n == pytest.approx(weight_n, rel=1e-4)
    assert last.imbalance_n < 1e-9 * weight_n
    assert last.moment_left_n_m < 1e-9 * weight_n * 0.05


def under_point_load(pattern: Pattern, point_m: np.ndarray, force_n: float) -> np.ndarray:
    """Displacement of the surface under a force downwards at a point of its upper face."""
    outer = pattern.surface.outer
    corner = outer.vertices_m[outer.facets]
    level = np.flatnonzero((np.abs(corner[:, :, 2] - point_m[2]) < 1e-9).all(axis=1))
    a, b, c = corner[level, :, :2].transpose(1, 0, 2)
    (share_b, share_c) = np.linalg.solve(
        np.stack([b - a, c - a], axis=2), (point_m[:2] - a)[..., None]
    )[..., 0].T
    (inside,) = np.flatnonzero((share_b > 0) & (share_c > 0) & (share_b + share_c < 1))
    load = np.zeros_like(outer.vertices_m)
    shares = [1.0 - share_b[inside] - share_c[inside], share_b[inside], share_c[inside]]
    load[outer.facets[level[inside]], 2] = -force_n * np.array(shares)
    return pattern.on_surface(pattern.solve_linear(pattern.on_nodes(load)))


def plank_scene(**changes: Any) -> Scenario:
    """Coarse grains over a plank that is clamped at both ends and as deep as the box."""
    scene: dict[str, Any] = {
        "dimension": 3,
        "box": {"width_m": 0.06, "depth_m": 0.03, "height_m": 0.08},
        "sand": {"size_scale": 8.0, "size_classes": 2, "disc_thickness_m": 0.1},
        "contact": {"grain_grain": SOFT, "grain_wall": SOFT, "springs_at_size_scale": None},
        "pattern": {
            "shape": {"kind": "bar", "width_m": 0.06, "height_m": 0.006},
            "position_m": [0.0, 0.0, 0.01],
            "element_m": 0.015,
            "young_modulus_pa": 1e6,
            "supports": {"clamped": ["left", "right"]},
            "loop": {"scheme": "measured", "window_s": 0.004},
        },
        "fill": {"layers": [{"count": 60}], "settling": {"shortest_s": 0.3}},
        "rest": {
            "check_every_s": 0.02,
            "rms_speed_m_s": 9,
            "load_tolerance": None,
            "checks": 1,
        },
        "time_step": {"fraction": 0.5},
        "vibration": [],
        "engine": {"name": "reference"},
    }
    return changed(scene, changes)


@pytest.mark.parametrize("engine", ENGINES)
def test_the_balances_of_a_bed_on_a_plank(engine: str, tmp_path: Path) -> None:
    scenario = plank_scene(engine={"name": engine})
    session = opened(scenario, tmp_path)
    session.insert_layer(1)
    session.start_stage(session.stage)
    while not session.stage_over:
        session.advance()
    snapshot, walls = session.snapshot(), session.surface_loads()
    session.close()
    log = read_convergence_log(tmp_path / CONVERGENCE_LOG)
    last = log[log.time_s > 0.25]
    masses = [scenario.sand.grain_mass_kg(2 * r, 3) for r in snapshot.radius_m]
    weight_n = scenario.gravity_m_s2 * sum(masses)
    # what floor and plank carry is the weight of the grains; these still move a little
    carried_n = snapshot.pattern_load_n[:, 2].sum() + walls["floor"][2]
    side_n = sum(walls[name][2] for name in ("left", "right", "front", "back"))
    assert -(carried_n + side_n) == pytest.approx(weight_n, rel=0.05)
    assert snapshot.pattern_load_n[:, 2].sum() < -0.5 * weight_n
    assert (last.imbalance_n < 1e-9 * last.load_n).all()
    assert (last.moment_left_n_m < 1e-9 * last.load_n * 0.06).all()
    assert (last.residual_m / last.displacement_m).median() < 0.1
    verdict = classify_loop(log)
    assert verdict is not None
    assert verdict.state == "holds"
    assert last.largest_m.iloc[-1] > 1e-5
