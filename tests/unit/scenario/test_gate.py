"""A gate in the scene, the pouring over a part of the box, the stages and what is foretold."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
import pytest

from sandmould.engines.durations import REST_AFTER_FLOW_S, stage_s
from sandmould.engines.guard import Guard, measure_health
from sandmould.engines.program import build_program
from sandmould.engines.session import EngineStop
from sandmould.runs.outcome import Outcome
from sandmould.scenario.checks.scene import problems
from sandmould.scenario.fill import FLOW_SETTLING
from sandmould.scenario.placement import (
    NOMINAL_FRACTION,
    filled_measure,
    plan_counts,
    predicted_bed_height_m,
)
from tests.hopper import (
    BOX_WIDTH_M,
    DEEP,
    FLOOR_M,
    HALF_INSIDE_M,
    LARGEST_M,
    MIDDLE_M,
    WALL_M,
    grains_at,
    hopper_plates,
    hopper_scene,
)
from tests.scenes import tube_scene

GATE_TOP_M = FLOOR_M + WALL_M / 2
INSIDE_M = (MIDDLE_M - HALF_INSIDE_M, MIDDLE_M + HALF_INSIDE_M)
SILO: dict[str, Any] = {
    "box": {"width_m": 2 * HALF_INSIDE_M, "height_m": 0.2},
    "obstacles": [
        plate | {"centre_m": [round(plate["centre_m"][0] - INSIDE_M[0], 9), FLOOR_M]}
        for plate in hopper_plates()[:3]
    ],
    "fill": {"over_x_m": None},
}
"""The hopper's floor from wall to wall of a box that holds the sand itself."""
STRIP: dict[str, Any] = DEEP | {
    "box": {"depth_m": 0.06},
    "obstacles": [],
    "discharge": None,
    "fill": {"over_y_m": [0.02, 0.05]},
}
"""An empty box in 3D, with sand poured over a part of its width and depth."""
DAM: dict[str, Any] = {
    "obstacles": [
        {"kind": "plate", "name": "gate", "centre_m": [0.1, 0.06], "size_m": [WALL_M, 0.12]}
    ],
    "fill": {"over_x_m": [0.0, 0.098]},
}


def sand_height_m(width_m: float) -> float:
    """Height of the hopper's sand over a floor of a width, as solid as a bed is taken to be."""
    return filled_measure(hopper_scene()) / NOMINAL_FRACTION[2] / width_m


def test_the_gate_is_gone_from_the_discharge_on() -> None:
    scene = hopper_scene()
    names = {block.name for block in scene.scene.blocks}
    middle = np.array([[MIDDLE_M, FLOOR_M]])
    for stage in ("settle_1", "between_1", "settle_2"):
        assert scene.scene_in(stage) is scene.scene
    for stage in ("discharge", "vibrate_1", "vibrate_2"):
        after = scene.scene_in(stage)
        assert {block.name for block in after.blocks} == names - {"gate"}
        assert after.walls == scene.scene.walls
        assert after.clearance_m(middle)[0] == pytest.approx(0.016)
    assert {block.name for block in scene.scene_in().blocks} == names - {"gate"}
    assert scene.scene.clearance_m(middle)[0] == pytest.approx(-WALL_M / 2)
    tube = tube_scene()
    assert tube.scene_in("vibrate_1") is tube.scene
    assert tube.gate is None


def test_discharge_and_its_rest_come_between_fill_and_vibration() -> None:
    between = {"acceleration_g": 1.0, "duration_s": 0.02}
    scene = hopper_scene(fill={"vibration_between_layers": between})
    stages = build_program(scene).stages
    assert [s.name for s in stages] == [
        "settle_1", "between_1", "settle_2", "discharge", "vibrate_1", "rest"
    ]  # fmt: skip
    discharge = stages[3]
    assert scene.discharge is not None
    assert [s.opens for s in stages] == ["", "", "", "gate", "", ""]
    assert discharge.settling is FLOW_SETTLING
    assert stages[2].settling == scene.fill.settling
    assert stages[1].settling is stages[4].settling is None
    assert not discharge.counts_as_vibration
    assert "discharge" not in [s.name for s in build_program(tube_scene()).stages]


def test_flow_through_a_wider_outlet_is_foretold_to_be_faster() -> None:
    def foretold_s(half_outlet_m: float) -> float:
        program = build_program(hopper_scene(obstacles=hopper_plates(half_outlet_m)))
        return stage_s(program, next(s for s in program.stages if s.opens))

    # Flow goes with the free width to the power of 3/2, after which the last grains roll.
    edge_m = 1.4 * hopper_scene().sand.mass_median_diameter_m
    narrow, wide = foretold_s(0.008), foretold_s(0.016)
    freer = (0.032 - edge_m) / (0.016 - edge_m)
    assert narrow - REST_AFTER_FLOW_S == pytest.approx((wide - REST_AFTER_FLOW_S) * freer**1.5)
    blocked = 0.4 * edge_m
    assert foretold_s(blocked) == FLOW_SETTLING.longest_s


@pytest.mark.parametrize("changes", [{}, STRIP], ids=["2D", "3D"])
def test_layers_are_planned_inside_what_they_are_poured_over(changes: dict[str, Any]) -> None:
    scene = hopper_scene(**changes)
    low, high = np.array(scene.pouring_m).T
    np.testing.assert_allclose([low[0], high[0]], INSIDE_M)
    layers = build_program(scene).layers
    for layer in layers:
        place, radius = layer.position_m[:, :-1], layer.radius_m[:, None]
        assert (place - radius > low).all()
        assert (place + radius < high).all()
    # The last layer, of 200 grains, uses all of it, nearly up to the bounds.
    assert (place.min(axis=0) < low + LARGEST_M).all()
    assert (place.max(axis=0) > high - LARGEST_M).all()


def test_the_floor_is_what_sand_is_poured_over() -> None:
    assert hopper_scene().floor_measure == pytest.approx(2 * HALF_INSIDE_M)
    assert hopper_scene(**STRIP).floor_measure == pytest.approx(2 * HALF_INSIDE_M * 0.03)
    assert tube_scene().floor_measure == pytest.approx(0.08)


def test_a_layer_height_counts_over_what_it_is_poured_over() -> None:
    scene = hopper_scene(fill={"layers": [{"height_m": 0.03}]})
    solid = 0.03 * 2 * HALF_INSIDE_M * NOMINAL_FRACTION[2]
    assert filled_measure(scene) == pytest.approx(solid, rel=0.5 / plan_counts(scene)[0])


@pytest.mark.parametrize(
    ("changes", "stands_on_m", "width_m"),
    [
        ({}, GATE_TOP_M, 2 * HALF_INSIDE_M),
        (SILO, GATE_TOP_M, 2 * HALF_INSIDE_M),
        ({"fill": {"over_x_m": [0.0, 0.06]}}, 0.0, 0.06),
        (DAM, 0.0, 0.098),
        (DAM | {"fill": {"over_x_m": [0.05, 0.15]}}, 0.0, 0.1),
    ],
    ids=["hopper", "silo", "beside the hopper", "behind a dam", "on both sides of a dam"],
)
def test_the_predicted_bed_stands_on_a_level_gate(
    changes: dict[str, Any], stands_on_m: float, width_m: float
) -> None:
    scene = hopper_scene(**changes)
    height_m = predicted_bed_height_m(scene, plan_counts(scene))
    assert height_m == pytest.approx(stands_on_m + sand_height_m(width_m))


def test_layers_fall_from_over_what_lies_under_them() -> None:
    # The hopper's sides stand beside the sand, not under it.
    assert hopper_scene().pouring_top_m == pytest.approx(GATE_TOP_M)
    everywhere = hopper_scene(fill={"over_x_m": None})
    assert everywhere.pouring_m == ((0.0, BOX_WIDTH_M),)
    assert everywhere.pouring_top_m == everywhere.scene.top_m == pytest.approx(0.148)


def test_sand_may_stand_above_a_floor_that_the_box_walls_hold_it_on() -> None:
    assert problems(hopper_scene(**SILO)) == []
    high = SILO | {"fill": {"over_x_m": None, "layers": [{"count": 1100}]}}
    (problem,) = problems(hopper_scene(**high))
    assert problem.valid == "layers that fit into box.height_m, 0.2 m"


@pytest.mark.parametrize("stage", ["settle_2", "discharge", "vibrate_1"])
def test_a_grain_where_the_gate_was_is_lost_only_before_the_opening(stage: str) -> None:
    scene = hopper_scene()
    stages = {s.name: s for s in build_program(scene).stages}
    grains = grains_at(np.array([[MIDDLE_M, FLOOR_M + 1e-3], [0.02, 0.03]]), 1.9e-3, stage)
    guard = Guard(scene)
    guard.start_stage(stages[stage], grains)
    if stage == "settle_2":
        with pytest.raises(EngineStop, match="the deepest is grain 1") as stop:
            guard.check(grains)
        assert stop.value.outcome is Outcome.LOST_GRAINS
    else:
        assert guard.check(grains).largest_overlap_fraction == 0.0


def test_a_grain_on_the_gate_overlaps_it_only_before_the_opening() -> None:
    on_the_gate = np.array([[MIDDLE_M, GATE_TOP_M + 0.9 * 2e-3]])
    for stage, overlap in (("settle_1", 0.1), ("discharge", 0.0)):
        health = measure_health(hopper_scene(), grains_at(on_the_gate, 2e-3, stage))
        assert math.isclose(health.largest_overlap_fraction, overlap, abs_tol=1e-9)
