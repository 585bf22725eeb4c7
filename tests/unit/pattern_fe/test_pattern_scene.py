"""A scenario's pattern: the outline that the sand meets, and what is told of a bad one."""

from __future__ import annotations

import os
import re
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from pydantic import ValidationError
from skfem import MeshTet

from sandmould.bad_input import BadInputError
from sandmould.engines.program import StepCounts
from sandmould.engines.snapshot import Snapshot, scene_at
from sandmould.kinds.sand.kind import SAND
from sandmould.pattern_fe.coupling.foam_body import FoamBody
from sandmould.pattern_fe.coupling.interface import with_surface
from sandmould.pattern_fe.coupling.session import window_ends
from sandmould.pattern_fe.scene import pattern_of
from sandmould.pattern_fe.shapes import bar, mesh_of, with_sides
from sandmould.scenario.checks.scene import problems
from sandmould.scenario.reading import Origin, merge
from sandmould.scenario.scenario import Scenario
from tests.patterns import write_mesh

L_SCENE: dict[str, Any] = {
    "box": {"width_m": 0.2, "height_m": 0.2},
    "pattern": {
        "shape": {"kind": "l_shape", "thickness_m": 0.01, "height_m": 0.06, "reach_m": 0.05},
        "position_m": [0.06, 0.0],
    },
    "engine": {"name": "reference"},
}


def l_scene(**pattern: Any) -> Scenario:
    tree = merge(L_SCENE, {"pattern": pattern} if pattern else {}, Origin(), "test")
    return Scenario.model_validate(tree)


def test_the_sand_meets_the_vertices_of_the_elements() -> None:
    scenario = with_surface(l_scene())
    (outline,) = scenario.scene.outlines
    body = FoamBody(pattern_of(scenario))
    np.testing.assert_array_equal(outline.vertices_m, body.vertices_m)
    # stem and flange: 0.01 x 0.06 + 0.04 x 0.01
    assert outline.measure == pytest.approx(1.0e-3)
    assert with_surface(scenario) == scenario


def test_runs_that_differ_in_their_sand_or_loop_share_a_pattern(tmp_path: Path) -> None:
    pattern = pattern_of(l_scene())
    assert pattern_of(l_scene(loop={"factor": 0.1}).model_copy(update={"seed": 7})) is pattern
    assert pattern_of(l_scene(young_modulus_pa=1e6)) is not pattern
    path = tmp_path / "bar.vtu"
    shape = {"kind": "file", "file": str(path)}
    widths = []
    for changed, width_m in enumerate((0.02, 0.03)):
        write_mesh(path, mesh_of(bar(width_m, 0.01), 0.01))
        os.utime(path, (changed, changed))
        told = {**L_SCENE, "pattern": {"shape": shape, "position_m": [0.01, 0.0]}}
        drawn_m = pattern_of(Scenario.model_validate(told)).surface.vertices_m
        widths.append(np.ptp(drawn_m[:, 0]))
    assert widths == pytest.approx([0.02, 0.03])


def test_a_scene_bends_with_its_snapshot() -> None:
    scenario = with_surface(l_scene())
    (outline,) = scenario.scene.outlines
    none = np.zeros((0, 2))
    lower = outline.vertices_m - [0.0, 0.003]
    snapshot = Snapshot(
        0.0, np.nan, "settle_1", np.zeros(0, int), np.zeros(0, int), none, none, np.zeros((0, 3)),
        np.zeros(0), pattern_m=lower,
    )  # fmt: skip
    top = np.array([[0.09, 0.06]])  # the highest edge as drawn
    assert scenario.scene.clearance_m(top) == pytest.approx(0.0)
    assert scene_at(scenario, snapshot).clearance_m(top) == pytest.approx(0.003)
    one_way = with_surface(l_scene(loop={"scheme": "one_way"}))
    assert scene_at(one_way, snapshot).clearance_m(top) == pytest.approx(0.0)


def test_the_flange_hangs_by_its_load_and_the_supports_carry_it() -> None:
    body = FoamBody(pattern_of(l_scene()))
    tip = np.argmax(body.vertices_m @ [1.0, 1.0])
    load = np.zeros_like(body.vertices_m)
    load[tip] = [0.0, -0.2]
    answer = body.solve(load)
    assert answer.displacement_m[tip, 1] < 0.0
    np.testing.assert_allclose(answer.reaction_n, [0.0, 0.2], atol=1e-9)
    assert answer.moment_left_n_m < 1e-9
    # Clapeyron: the load's work is twice the stored energy.
    assert answer.energy_j == pytest.approx(-0.1 * answer.displacement_m[tip, 1], rel=1e-9)
    large_body = FoamBody(pattern_of(l_scene()), large=True)
    # The arm is longer by some mm where the flange has come to: on the drawing a moment is left.
    assert large_body.solve(load).moment_left_n_m < 1e-9
    large = large_body.solve(0.01 * load)
    np.testing.assert_allclose(
        large.displacement_m[tip], 0.01 * answer.displacement_m[tip], rtol=1e-2
    )


@pytest.mark.parametrize(
    ("pattern", "says"),
    [
        ({"supports": {"clamped": ["roof"]}}, "pattern.supports = .*'roof', which is not there"),
        ({"supports": {"clamped": []}}, "pattern.supports = .*free to shift along x"),
        ({"position_m": [0.18, 0.0]}, r"pattern.position_m = \[0.18, 0.0\]"),
        ({"shape": {"kind": "l_shape", "thickness_m": 0.01, "height_m": 0.005, "reach_m": 0.05}},
         "pattern.shape = .*thickness is 0.01 m, valid is below its height"),
        ({"shape": {"kind": "file", "file": "nowhere.msh"}}, "pattern.shape = .*nowhere.msh"),
    ],
)  # fmt: skip
def test_a_pattern_that_cannot_be_computed_is_told(pattern: dict[str, Any], says: str) -> None:
    tree = {**L_SCENE, "pattern": {**L_SCENE["pattern"], **pattern}}
    with pytest.raises(BadInputError, match=says):
        with_surface(Scenario.model_validate(tree))


@pytest.mark.parametrize(
    ("pattern", "scene", "says"),
    [
        ({}, {"engine": {"name": "lammps"}}, "pattern.loop.scheme = 'monolithic' .* on engine lam"),
        ({"statics": "large"}, {}, "pattern.loop.scheme = 'monolithic' .* pattern.statics = large"),
        ({"loop": {"scheme": "monolithic", "mass_scale": 1.0}}, {}, "contacts would throw its li"),
        ({}, {"vibration": [{"acceleration_g": 1.0}]}, "in_step, or a sho.* first fr"),
        ({"loop": {"scheme": "in_step"}, "statics": "large"}, {}, "scheme = 'in_step' .* = large"),
        ({"loop": {"scheme": "in_step", "mass_scale": 1e-3}}, {}, "null, or at least 3.89, at whi"),
        ({"loop": {"scheme": "in_step", "mass_scale": 1.01}, "supports": {"free": True},
          "position_m": [0.06, 0.05]}, {}, "mass_scale = 1.01 .* null, or at least 5.0"),
        ({"loop": {"scheme": "in_step", "mass_scale": 1e4}},
         {"vibration": [{"acceleration_g": 1.0}]},
         "mass_scale = 1.* null with time_step.fraction = 0.* 50 Hz or 0.9 times the foam's own"),
    ],
)  # fmt: skip
def test_what_a_scheme_lacks_is_told(
    pattern: dict[str, Any], scene: dict[str, Any], says: str
) -> None:
    told = {**L_SCENE["pattern"], "loop": {"scheme": "monolithic"}, **pattern}
    with pytest.raises(BadInputError, match=says):
        with_surface(Scenario.model_validate({**L_SCENE, "pattern": told, **scene}))


def test_a_pattern_that_swings_like_the_foam_may_be_shaken() -> None:
    told = {**L_SCENE["pattern"], "loop": {"scheme": "in_step"}}
    shaken = {"vibration": [{"acceleration_g": 1.0, "frequency_hz": 65.0}]}
    for engine in ("reference", "lammps"):
        quick = {"time_step": {"fraction": 0.05}, "engine": {"name": engine}}
        scene = {**L_SCENE, "pattern": told, **shaken, **quick}
        with_surface(Scenario.model_validate(scene))


@pytest.mark.parametrize(("key", "value"), [("fraction", 0.7), ("step_s", 1e-6)])
def test_a_time_step_that_swings_the_pattern_names_one_that_does_not(
    key: str, value: float
) -> None:
    told = {"supports": {"free": True}, "position_m": [0.06, 0.05], "loop": {"scheme": "in_step"}}
    shaken = [{"acceleration_g": 1.0, "frequency_hz": 150.0}]
    scene = {**L_SCENE, "pattern": {**L_SCENE["pattern"], **told}, "vibration": shaken}
    with pytest.raises(BadInputError) as refused:
        with_surface(Scenario.model_validate({**scene, "time_step": {key: value}}))
    (problem,) = refused.value.problems
    assert (problem.key, problem.value) == (f"time_step.{key}", value)
    named = float(problem.valid.removeprefix("at most ").partition(":")[0])
    assert named > 0.1 * value
    with_surface(Scenario.model_validate({**scene, "time_step": {key: named}}))


SPACE: dict[str, Any] = {"dimension": 3, "box": {"depth_m": 0.08}, "engine": {"name": "reference"}}


def in_space(scene: dict[str, Any] = SPACE, **pattern: Any) -> Scenario:
    """The L between y = 20 mm and the back of a box, elements as long as it is thick."""
    told = {"position_m": [0.06, 0.02, 0.0], "element_m": 0.02, **pattern}
    tree = merge(l_scene().model_dump(mode="json"), scene, Origin(), "test")
    return Scenario.model_validate({**tree, "pattern": {**tree["pattern"], **told}})


@pytest.mark.parametrize(("depth_m", "exact_m"), [(None, 0.06), (0.03, 0.03)])
def test_in_space_the_sand_meets_triangles(depth_m: float | None, exact_m: float) -> None:
    scenario = with_surface(in_space(depth_m=depth_m))
    (mesh,) = scenario.scene.meshes
    body = FoamBody(pattern_of(scenario))
    np.testing.assert_array_equal(mesh.vertices_m, body.vertices_m)
    # stem and flange: 0.01 x 0.06 + 0.04 x 0.01
    assert mesh.measure == pytest.approx(1.0e-3 * exact_m)
    assert not problems(scenario)
    assert with_surface(scenario) == scenario
    lower = mesh.vertices_m - [0.0, 0.0, 0.003]
    assert scenario.scene.bent("pattern", lower).top_m == pytest.approx(0.057)


def test_a_mesh_file_of_tetrahedra_meets_the_sand(tmp_path: Path) -> None:
    path, lines = tmp_path / "cube.vtu", [np.array([0.0, 0.02])] * 3
    write_mesh(path, with_sides(MeshTet.init_tensor(*lines)))
    scenario = with_surface(in_space(shape={"kind": "file", "file": str(path)}))
    (mesh,) = scenario.scene.meshes
    assert mesh.measure == pytest.approx(8e-6)
    assert mesh.vertices_m.min(axis=0) == pytest.approx([0.06, 0.02, 0.0])
    flat = {**L_SCENE, "pattern": {"shape": {"kind": "file", "file": str(path)}}}
    with pytest.raises(BadInputError, match=r"cube.vtu is in 3D, valid is a mesh in 2D as the sce"):
        pattern_of(Scenario.model_validate(flat))


@pytest.mark.parametrize(
    ("scene", "pattern", "says"),
    [
        ({}, {"position_m": [0.06, 0.0]}, r"pattern.position_m = \[0.06, 0.0\] .* 3 numbers, one"),
        ({}, {"depth_m": 0.07}, r"pattern.position_m = .* reaches from \(0.06, 0.02, 0\) to"),
        ({}, {"loop": {"scheme": "monolithic"}}, r"scheme = 'monolithic' .* another scheme in 3D"),
        (
            {},
            {"loop": {"scheme": "in_step"}, "element_m": 0.005},
            r"element_m = 0.005 .* at most 5,000 components of a surface",
        ),
        (
            {
                **SPACE,
                "obstacles": [
                    {
                        "kind": "plate",
                        "name": "post",
                        "centre_m": [0.02, 0.04, 0.05],
                        "size_m": [0.01, 0.01, 0.02],
                    }
                ],
            },
            {"loop": {"scheme": "in_step"}},
            r"scheme = 'in_step' .* with windows in 3D beside the obstacle 'post'",
        ),
        (
            {},
            {"loop": {"scheme": "per_layer"}, "young_modulus_pa": 1e3},
            r"scheme = 'per_layer' .* for so soft a foam",
        ),
        ({"engine": {"name": "liggghts"}, "frame": "box"}, {}, r"engine.name = 'liggghts' .* lamm"),
        ({"dimension": 2}, {"depth_m": 0.1, "position_m": [0.06, 0.0]}, r"depth_m = 0.1 .* null"),
    ],
)
def test_what_is_not_coupled_in_space_is_told(
    scene: dict[str, Any], pattern: dict[str, Any], says: str
) -> None:
    with pytest.raises(BadInputError, match=says):
        with_surface(in_space({**SPACE, **scene}, **pattern))


def test_layers_in_space_go_with_a_foam_that_is_stiff_enough() -> None:
    with_surface(in_space(SPACE, young_modulus_pa=1e9, loop={"scheme": "per_layer"}))


@pytest.mark.parametrize(
    ("triangles", "says"),
    [
        ([[0, 1, 2], [0, 3, 1], [0, 2, 3], [1, 3, 2]], r"counter-clockwise seen from outside"),
        ([[0, 2, 1], [0, 1, 3], [0, 3, 2], [1, 2, 4]], r"between its 4 vertices"),
        ([[0, 2, 1], [0, 1, 3], [0, 3, 2], [0, 3, 2]], r"triangles that differ"),
    ],
)
def test_triangles_that_bound_no_solid_are_told(triangles: list[list[int]], says: str) -> None:
    corners = [[0.01, 0.01, 0.01], [0.03, 0.01, 0.01], [0.01, 0.03, 0.01], [0.01, 0.01, 0.03]]
    solid = {"kind": "triangles", "vertices_m": corners, "triangles": triangles}
    (found,) = problems(Scenario.model_validate({"dimension": 3, "obstacles": [solid]}))
    assert re.search(says, str(found))


@pytest.mark.parametrize("ratio", [0.5, -1.0])
def test_foam_that_keeps_its_volume_is_told(ratio: float) -> None:
    with pytest.raises(ValidationError, match="poisson_ratio"):
        l_scene(poisson_ratio=ratio)


def test_another_foam_is_another_result() -> None:
    one, other = (SAND.planning.resolved(l_scene(young_modulus_pa=e)) for e in (1e6, 2e6))
    assert SAND.planning.computed_hash(one) != SAND.planning.computed_hash(other)
    assert SAND.planning.template_hash(one) != SAND.planning.template_hash(
        one.model_copy(update={"pattern": None})
    )


def test_windows_fill_a_record_with_whole_samples() -> None:
    ends = window_ends(0.002, StepCounts(1e-5, 20, 20 * 47, 20 * 47))
    assert ends[-1] == 20 * 47
    assert set(ends % 20) == {0}
    assert len(ends) == round(47 * 20e-5 / 0.002)
    assert np.ptp(np.diff(ends, prepend=0)) <= 20
    assert window_ends(1.0, StepCounts(1e-5, 20, 940, 940)).tolist() == [940]
    assert len(window_ends(1e-9, StepCounts(1e-5, 20, 940, 940))) == 47


@pytest.mark.parametrize(
    ("engine", "loop", "says"),
    [
        (
            "liggghts",
            {"scheme": "in_step"},
            "scheme = 'in_step' .* valid is one_way, per_layer, fixed, aitken",
        ),
        ("liggghts", {}, "frame = 'laboratory' cannot be used: valid is box in a scene with"),
        (
            "liggghts",
            {"scheme": "measured"},
            "scheme = 'measured' .* valid is one_way, per_layer, fixed, ait",
        ),
        ("liggghts", {}, "pattern.loop.repeats = 12 cannot be used: valid is 0 on eng"),
    ],
)
def test_what_an_engine_cannot_couple_is_told(engine: str, loop: dict[str, Any], says: str) -> None:
    frame = "laboratory" if "frame" in says else "box"
    tree = {**L_SCENE, "engine": {"name": engine}, "frame": frame}
    tree["pattern"] = {**L_SCENE["pattern"], "loop": loop}
    with pytest.raises(BadInputError, match=says):
        SAND.planning.resolved(Scenario.model_validate(tree))


def test_a_gate_beside_a_pattern_is_told() -> None:
    scenario = Scenario.model_validate({**L_SCENE, "discharge": {"gate": "gate"}})
    with pytest.raises(BadInputError, match=r"discharge.gate = 'gate' .* absent in a scene with"):
        SAND.planning.resolved(scenario)
