"""The step of a filled bed: its limit against exact ones, and when it is looked at."""

from __future__ import annotations

import math
from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from sandmould.engines.bed_step import MOMENTS, limit_moments, limit_notes, with_bed_step
from sandmould.engines.durations import cost_before, stage_s
from sandmould.engines.program import build_program
from sandmould.engines.reference.session import ReferenceSession
from sandmould.engines.session import EngineStop
from sandmould.scenario.reading import Origin, merge
from sandmould.scenario.scenario import Scenario
from sandmould.scenario.time_step import damped_step
from tests.scenes import TUBE_SCENE, tube_scene

OF_BED: dict[str, Any] = {"engine": {"name": "reference"}, "time_step": {"bed_fraction": 0.7}}
SMOOTH = {"normal_stiffness_n_m": 7e4, "tangential_stiffness_n_m": 7e4, "friction": 0.0,
          "rolling_arm_fraction": 0.0}  # fmt: skip
OVERLAP = 1e-6
"""Over the radius: the springs of smooth grains do not depend on it."""


def limit_s(zeta: float, place: list[list[float]]) -> float:
    """Limit of equal smooth grains at places in radii, in units of sqrt(m/k)."""
    d, law = len(place[0]), {**SMOOTH, "damping_ratio": zeta}
    scene = tube_scene(
        **OF_BED,
        dimension=d,
        box={"depth_m": 0.08},
        obstacles=[],
        sand={"size_classes": 1},
        fill={"layers": [{"count": len(place)}]},
        contact={"grain_grain": law, "grain_wall": law},
    )
    session = ReferenceSession(build_program(scene))
    session.insert_layer(1)
    radius = session.snapshot().radius_m[0]
    position = np.array(place) * radius * (1 - OVERLAP)
    position[:, :-1] += 0.04
    session.set_state(position, np.zeros_like(position), np.zeros((len(place), 3)))
    spring = scene.laws.grain_grain.normal_stiffness_n_m
    mass = scene.sand.grain_mass_kg(2 * radius, d)
    return session.exact_limit_s() * math.sqrt(spring / mass)


@pytest.mark.parametrize("dimension", [2, 3])
@pytest.mark.parametrize("zeta", [0.0, 0.4, 1.0])
def test_a_grain_on_the_floor_has_the_limit_of_its_oscillator(zeta: float, dimension: int) -> None:
    place = [[0.0] * (dimension - 1) + [1.0]]
    # c / (4 m) of a contact with a wall is zeta omega / 2; the corrected limit by Newton's way
    assert limit_s(zeta, place) == pytest.approx(damped_step(1.0, zeta, 0.5 * zeta))


@pytest.mark.parametrize("columns", [1, 3])
def test_a_square_lattice_on_the_floor_has_its_exact_limit(columns: int) -> None:
    # Smooth rows and columns move apart; a column held at the floor is stiffer than a free row.
    n = 5
    place = [[2.0 * i, 2.0 * k + 1.0] for i in range(columns) for k in range(n)]
    omega = 2 * math.sin((2 * n - 1) / (2 * n + 1) * math.pi / 2)
    assert limit_s(0.0, place) == pytest.approx(2.0 / omega, rel=1e-6)


def test_the_step_is_rounded_down_and_only_the_step_changes() -> None:
    scene = tube_scene(**OF_BED)
    given = with_bed_step(scene, 4.369714397628601e-05)
    assert given.step_s == 3.058e-05  # 0.7 of it is 3.0588e-05
    back = given.time_step.model_copy(update={"step_s": None})
    assert given.model_copy(update={"time_step": back}) == scene
    # the last digits of the eigenproblem do not reach it
    assert with_bed_step(scene, 4.369714397628601e-05 * (1 + 1e-10)).step_s == given.step_s


def test_soft_beds_keep_to_the_vibration_and_loose_ones_to_the_plan() -> None:
    scene = tube_scene(**OF_BED)  # 50 Hz, checks of 5 ms
    assert with_bed_step(scene, 1.0).step_s == pytest.approx(1 / 50 / 20)
    assert with_bed_step(scene, math.inf).step_s == scene.planned_step_s


def test_moments_see_all_phases_of_the_box() -> None:
    scene = tube_scene(**OF_BED, vibration=[{"acceleration_g": 1.5, "frequency_hz": 50.0,
                                             "duration_s": 2.0}])  # fmt: skip
    program = build_program(scene)
    moments, steps = limit_moments(program), stage_s(program, program.stages[-2]) / scene.step_s
    twentieths = [int(moment / steps * MOMENTS) for moment in moments]
    assert twentieths == list(range(MOMENTS))
    phases = np.sort(np.array(moments) * scene.step_s * 50.0 % 1.0)
    gaps = np.diff(np.append(phases, phases[0] + 1.0))
    # twenty places by chance leave a gap above 0.3 in one case of seventy
    assert gaps.max() < 0.2


def test_a_step_of_the_users_own_waits_for_the_bed_and_keeps_below_its_limit() -> None:
    scene = tube_scene(time_step={"step_s": 4e-5})
    assert scene.step_s == scene.planned_step_s < scene.critical_step.step_s < 4e-5
    given = with_bed_step(scene, 5e-5)
    assert (given.step_s, given.time_step.bed_fraction) == (4e-5, pytest.approx(0.8))
    with pytest.raises(EngineStop, match=r"time_step.step_s = 4e-05 cannot be used: valid is at m"):
        with_bed_step(scene, 3.9e-5)
    # one that the plan allows is that of the whole run
    whole = tube_scene(time_step={"step_s": 3e-5})
    assert (whole.step_s, whole.takes_step_of_bed) == (3e-5, False)


@pytest.mark.parametrize("change", [{"vibration": []}, {"time_step": {"step_s": 1e-5}}])
def test_the_step_of_the_bed_is_taken_where_there_is_one(change: dict[str, Any]) -> None:
    tree = {key: value for key, value in TUBE_SCENE.items() if key != "time_step"}
    scene = Scenario.model_validate(tree)
    assert scene.time_step.bed_fraction == 0.7
    changed = Scenario.model_validate(merge(tree, change, Origin(), "test"))
    assert not changed.takes_step_of_bed
    # the fill of a scene that is shaken is one of its own
    assert Scenario.model_validate(scene.before_vibration.model_dump()).takes_step_of_bed


def test_a_limit_below_the_step_is_told() -> None:
    cost = replace(cost_before(tube_scene()), time_step_s=3e-5)
    assert limit_notes(cost) == limit_notes(replace(cost, least_limit_s=3e-5)) == []
    (note,) = limit_notes(replace(cost, least_limit_s=2.9e-5))
    assert note.startswith("the time step 3e-05 s was above the exact limit of the shaken bed")
    (note,) = limit_notes(replace(cost, begun_again=2, bed_limit_s=4e-5, least_limit_s=4e-5))
    assert note.startswith("the run began again from its fill 2 times, since the exact limit of")
