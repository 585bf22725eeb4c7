"""Sand, vibration, time step and geometry against values worked out by hand."""

from __future__ import annotations

import math

import numpy as np
import pytest

from sandmould.scenario.box import Box, Tube, build_scene, facet_apothem_m
from sandmould.scenario.contact import Contact, ContactLaw
from sandmould.scenario.placement import WALL_GAP, loose_height_m, plan_counts, plan_layer
from sandmould.scenario.sand import Sand, SievePoint
from sandmould.scenario.scenario import Scenario
from sandmould.scenario.time_step import TimeStep, critical_step
from sandmould.scenario.vibration import STANDARD_GRAVITY_M_S2, VibrationStage

EQUAL = Sand(
    sieve=(
        SievePoint(opening_m=1e-3, passing_fraction=0.0),
        SievePoint(opening_m=1.21e-3, passing_fraction=1.0),
    ),
    size_scale=1.0,
    size_classes=1,
)
"""Grains of one diameter, 1.1 mm."""


def test_classes_keep_the_mass_of_the_sieve_curve() -> None:
    sand = Sand()
    for dimension in (2, 3):
        classes = sand.classes(dimension)
        assert sum(c.mass_fraction for c in classes) == pytest.approx(1)
        assert sum(c.count_fraction for c in classes) == pytest.approx(1)
        mass = [c.count_fraction * sand.grain_mass_kg(c.diameter_m, dimension) for c in classes]
        shares = np.array(mass) / sum(mass)
        np.testing.assert_allclose(shares, [c.mass_fraction for c in classes], rtol=1e-12)
    assert sand.classes(2)[0].diameter_m > 1e-3
    assert sand.classes(2)[-1].diameter_m < 4.5e-3


def test_one_class_stands_at_the_geometric_mean() -> None:
    (only,) = EQUAL.classes(2)
    assert only.diameter_m == pytest.approx(1.1e-3)
    assert EQUAL.grain_mass_kg(2e-3, 2) == pytest.approx(2400 * math.pi * 1e-6 * EQUAL.thickness_m)
    assert EQUAL.grain_mass_kg(2e-3, 3) == pytest.approx(2400 * math.pi / 6 * 8e-9)


def test_held_amplitude_stays_the_same_when_the_frequency_changes() -> None:
    at_50 = VibrationStage(acceleration_g=1.5, frequency_hz=50)
    omega = 2 * math.pi * 50
    assert at_50.amplitude_m == pytest.approx(1.5 * STANDARD_GRAVITY_M_S2 / omega**2)
    assert at_50.amplitude_m == pytest.approx(0.149e-3, rel=2e-3)
    for hold, acceleration_g in (
        ("acceleration", 1.5),
        ("velocity", 1.5 * 85 / 50),
        ("displacement", 1.5 * (85 / 50) ** 2),
    ):
        stage = VibrationStage.model_validate(
            {"acceleration_g": 1.5, "hold": hold, "frequency_hz": 85,
             "reference_frequency_hz": 50}
        )  # fmt: skip
        assert stage.peak_acceleration_g == pytest.approx(acceleration_g)


def test_stage_lasts_whole_periods_and_ends_where_it_began() -> None:
    stage = VibrationStage(acceleration_g=1.5, frequency_hz=30, duration_s=1.01, ramp_s=0.1)
    assert stage.whole_duration_s == pytest.approx(1.0)
    assert stage.displacements_at(np.array(0.0)) == stage.displacements_at(np.array(1.0)) == 0.0
    quarter = 0.5 + 1 / 120
    assert stage.displacements_at(np.array(quarter)) == pytest.approx(stage.amplitude_m)
    # Half way up the ramp, 1.5 periods in; a quarter period later it is a bit further.
    assert stage.displacements_at(np.array(0.05 + 1 / 120)) == pytest.approx(
        -stage.amplitude_m * (0.5 + 1 / 12)
    )


def test_critical_step_of_equal_undamped_discs() -> None:
    law = ContactLaw(normal_stiffness_n_m=7e4, tangential_stiffness_n_m=1.0, damping_ratio=0.0)
    soft = ContactLaw(normal_stiffness_n_m=1.0, tangential_stiffness_n_m=1.0)
    found = critical_step(EQUAL, Contact(grain_grain=law, grain_wall=soft), TimeStep(), 2)
    mass = EQUAL.grain_mass_kg(1.1e-3, 2)
    assert found.step_s == pytest.approx(2 / math.sqrt(6 * 7e4 / mass))
    assert found.cause == "normal grain-grain contact"


def test_damping_and_softer_springs_move_the_critical_step() -> None:
    paper = critical_step(Sand(), Contact(), TimeStep(), 2).step_s
    undamped = ContactLaw(damping_ratio=0.0)
    assert critical_step(Sand(), Contact(grain_grain=undamped), TimeStep(), 2).step_s > paper
    hard = ContactLaw(normal_stiffness_n_m=28e4)
    found = critical_step(Sand(), Contact(grain_grain=hard), TimeStep(), 2)
    assert found.step_s == pytest.approx(paper / 2)


TUBE = Tube(kind="tube", diameter_m=0.02, length_m=0.05, left_end_x_m=0.03, axis_height_m=0.04)


def test_tube_in_2d_is_two_plates_and_an_end() -> None:
    scene = build_scene(Box(width_m=0.1, height_m=0.1), (TUBE,), 2)
    assert [b.name for b in scene.blocks] == ["tube_lower", "tube_upper", "tube_end"]
    points = np.array([[0.05, 0.04], [0.05, 0.0285], [0.0815, 0.04], [0.02, 0.04]])
    found = scene.clearance_m(points)
    np.testing.assert_allclose(found, [0.01, -0.0015, -0.0015, 0.01 * math.sqrt(2)], atol=1e-12)
    (bore,) = scene.bores
    assert bore.measure == pytest.approx(0.02 * 0.05)
    depth, across = bore.local(np.array([[0.05, 0.045]]))
    np.testing.assert_allclose([depth[0], across[0, 0]], [0.02, 0.005])


def test_copy_with_other_obstacles_has_their_geometry() -> None:
    scenario = Scenario.model_validate({"obstacles": [TUBE]})
    assert len(scenario.scene.blocks) == 3
    assert scenario.model_copy(update={"obstacles": ()}).scene.blocks == ()
    assert scenario.model_copy(update={"seed": 2}).scene is scenario.scene


def test_tube_at_the_box_wall_needs_no_end() -> None:
    scene = build_scene(Box(width_m=0.08, height_m=0.1), (TUBE,), 2)
    assert [b.name for b in scene.blocks] == ["tube_lower", "tube_upper"]
    # 0.35 + 0.05 is less than 0.4 by its last digit
    tube = TUBE.model_copy(update={"left_end_x_m": 0.35})
    scene = build_scene(Box(width_m=0.4, height_m=0.1), (tube,), 2)
    assert [b.name for b in scene.blocks] == ["tube_lower", "tube_upper"]


@pytest.mark.parametrize("facets", [4, 8, 16])
def test_tube_in_3d_has_the_bore_of_the_circle(facets: int) -> None:
    tube = TUBE.model_copy(update={"facets": facets, "closed_end": "none"})
    scene = build_scene(Box(width_m=0.1, depth_m=0.06, height_m=0.1), (tube,), 3)
    assert scene.bores[0].section_measure == pytest.approx(math.pi / 4 * 0.02**2)
    centre = scene.clearance_m(np.array([[0.055, 0.03, 0.04]]))
    assert centre[0] == pytest.approx(facet_apothem_m(tube))
    assert len(scene.blocks) == facets


def test_layer_amounts_turn_into_grains() -> None:
    area = math.pi / 4 * 1.1e-3**2
    layers = [{"count": 7}, {"mass_kg": 2400 * 1.1e-3 * area * 50}, {"height_m": 0.01, "repeat": 2}]
    scene = Scenario.model_validate({"sand": EQUAL, "fill": {"layers": layers}})
    by_height = round(0.01 * 0.1 * 0.8 / area)
    assert plan_counts(scene) == [7, 50, by_height, by_height]
    assert loose_height_m(scene, 100) == pytest.approx(100 * area / 0.1 / 0.45)


@pytest.mark.parametrize("dimension", [2, 3])
def test_planned_layer_has_no_overlaps_and_repeats(dimension: int) -> None:
    box = {"width_m": 0.06, "depth_m": 0.05}
    scene = Scenario.model_validate(
        {"dimension": dimension, "box": box, "sand": {"size_scale": 6.0}}
    )
    layer = plan_layer(scene, 1, 200)
    x, r = layer.position_m, layer.radius_m
    gap = np.linalg.norm(x[:, None] - x[None], axis=2) - (r[:, None] + r[None])
    assert gap[~np.eye(200, dtype=bool)].min() > 0
    assert (x[:, 0] - r).min() >= WALL_GAP * r.min() * 0.999
    assert (x[:, -1] - r).min() == pytest.approx(0)
    np.testing.assert_array_equal(plan_layer(scene, 1, 200).position_m, x)
    assert not np.array_equal(plan_layer(scene, 2, 200).position_m, x)


@pytest.mark.parametrize("dimension", [2, 3])
def test_corrected_dashpots_lengthen_the_critical_step(dimension: int) -> None:
    plain, corrected = (
        critical_step(Sand(), Contact(dashpot=dashpot), TimeStep(), dimension).step_s
        for dashpot in ("plain", "corrected")
    )
    # (4 - n h^2) (1 + h / sqrt(2)) = 2 sqrt(2) n h with n = 6 contacts, solved by hand.
    assert corrected / plain == pytest.approx(1.1486, abs=1e-4)
