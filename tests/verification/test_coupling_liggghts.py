"""The staggered loop with LIGGGHTS, whose mesh is exchanged, beside the reference engine."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest

from sandmould.engines.driver import Driver
from sandmould.engines.liggghts.mesh_files import outline_strips
from sandmould.engines.liggghts.session import BendingMesh, TriangleLoads
from sandmould.pattern_fe.coupling.convergence_log import CONVERGENCE_LOG, read_convergence_log
from sandmould.pattern_fe.coupling.interface import with_surface
from sandmould.pattern_fe.coupling.loop_verdict import classify_loop
from sandmould.pattern_fe.coupling.opening import open_coupled
from sandmould.runs.outcome import Outcome
from sandmould.scenario.scenario import Scenario
from tests.liggghts_scenes import needs_liggghts
from tests.patterns import _one_thread  # noqa: F401
from tests.workflow.runs import drive


def plank_scene(engine: str) -> Scenario:
    scene: dict[str, Any] = {
        "box": {"width_m": 0.05, "height_m": 0.07},
        "sand": {
            "size_scale": 8.0,
            "size_classes": 2,
            "disc_inertia": "sphere",
            "disc_thickness_m": 0.1,
        },
        "background_damping": {"form": "none"},
        "pattern": {
            "shape": {"kind": "bar", "width_m": 0.05, "height_m": 0.006},
            "position_m": [0.0, 0.012],
            "young_modulus_pa": 3.2e6,
            "supports": {"clamped": ["left", "right"]},
            "loop": {"scheme": "fixed", "factor": 0.3, "window_s": 0.005, "repeats": 0},
        },
        "fill": {
            "layers": [{"count": 40}],
            "drop_height_m": 0.001,
            "settling": {"shortest_s": 0.1},
        },
        "vibration": [],
        "rest": {"rms_speed_m_s": 9, "load_tolerance": None, "checks": 1, "load_every_steps": 40},
        "engine": {"name": engine},
    }
    return with_surface(Scenario.model_validate(scene))


def driver(*arguments: Any) -> Driver:
    return Driver(*arguments, open_coupled)


@needs_liggghts
def test_plank_bends_as_on_the_reference_engine(tmp_path: Path) -> None:
    ends = []
    for engine in ("reference", "liggghts"):
        (folder := tmp_path / engine).mkdir()
        assert drive(plank_scene(engine), folder, driver).outcome is Outcome.FINISHED
        log = read_convergence_log(folder / CONVERGENCE_LOG)
        found = classify_loop(log)
        assert found is not None
        assert found.state == "holds"
        ends.append(log.iloc[-4:].mean())
    reference, liggghts = ends
    assert reference.largest_m > 1e-5
    # The walls' share of the weight depends on how the sand fell; 0.1 % measured.
    assert liggghts.load_n == pytest.approx(reference.load_n, rel=0.1)
    assert liggghts.largest_m == pytest.approx(reference.largest_m, rel=0.1)


def test_loads_of_triangles_go_to_the_vertices_of_their_side() -> None:
    vertices_m = np.array([[0.0, 0.0], [0.04, 0.0], [0.04, 0.03], [0.0, 0.03]])
    mesh = BendingMesh("pattern", vertices_m)
    # Long sides are cut along the plane's depth or along themselves: both kinds are here.
    corners_m = outline_strips(vertices_m, (-0.0005, 0.0005))
    right = np.isclose(corners_m[..., 0], 0.04).all(axis=1)
    stress_pa = np.where(right[:, None], [[-2.0, 0.5, 0.0]], 0.0)
    area_m2 = np.full(len(corners_m), 1.0 / right.sum())
    for begins in (True, False):
        mesh.add(TriangleLoads(corners_m, area_m2, stress_pa), begins)
    assert mesh.samples == 2
    np.testing.assert_allclose(mesh.sums_n, [[0, 0], [-2, 0.5], [-2, 0.5], [0, 0]], atol=1e-12)
    mesh.add(TriangleLoads(corners_m, area_m2, stress_pa), True)
    assert mesh.samples == 1
    np.testing.assert_allclose(mesh.sums_n.sum(axis=0), [-2.0, 0.5])
