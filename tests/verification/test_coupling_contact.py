"""Soft planks under sand, over floors and posts: no scheme lets them through."""

from __future__ import annotations

import re
from pathlib import Path
from typing import Any, get_args

import numpy as np
import pandas as pd
import pytest
from numpy.typing import NDArray

from sandmould.engines.driver import Driver
from sandmould.kinds.sand.bending import verdict_of
from sandmould.pattern_fe.coupling.convergence_log import CONVERGENCE_LOG, read_convergence_log
from sandmould.pattern_fe.coupling.interface import with_surface
from sandmould.pattern_fe.coupling.loop_verdict import classify_loop
from sandmould.pattern_fe.coupling.opening import open_coupled
from sandmould.pattern_fe.coupling.shapes_file import SHAPES
from sandmould.pattern_fe.scene import pattern_of, surroundings_of
from sandmould.runs.outcome import Outcome
from sandmould.scenario.fill import Rest
from sandmould.scenario.pattern import Scheme
from sandmould.scenario.reading import Origin, merge
from sandmould.scenario.scenario import Scenario
from tests.patterns import _one_thread, read_shapes  # noqa: F401
from tests.workflow.runs import drive

Array = NDArray[np.float64]
HASTY = {"check_every_s": 0.008, "checks": 1, "rms_speed_m_s": 10.0, "load_tolerance": None}
"""A stage ends at its shortest time: contact is looked at in all records, at rest or not."""
SCENE: dict[str, Any] = {
    "box": {"width_m": 0.06, "height_m": 0.08},
    "sand": {"size_scale": 8.0, "size_classes": 2, "disc_thickness_m": 0.1},
    "fill": {
        "layers": [{"count": 40}],
        "drop_height_m": 0.0005,
        "settling": {"shortest_s": 0.05},
    },
    "rest": HASTY,
    "time_step": {"fraction": 0.4},
    "vibration": [],
    "record": {"series_every_s": 0.008, "checkpoint_every_s": 0.5},
    "engine": {"name": "reference"},
    "pattern": {
        "shape": {"kind": "bar", "width_m": 0.04, "height_m": 0.005},
        "position_m": [0.0, 0.003],
        "young_modulus_pa": 1e4,
        "supports": {"clamped": ["left"]},
        "loop": {"window_s": 0.004, "repeats": 2},
    },
}
POST = {"kind": "plate", "centre_m": [0.0307, 0.001], "size_m": [0.001, 0.002]}
SCHEMES: tuple[Scheme, ...] = get_args(Scheme)


def scene(**changes: Any) -> Scenario:
    return with_surface(Scenario.model_validate(merge(SCENE, changes, Origin(), "test")))


def driven(scenario: Scenario, folder: Path) -> tuple[Array, pd.DataFrame]:
    """Run: displacements of the surface at all records, and the convergence log."""
    outcome = drive(scenario, folder, lambda *given: Driver(*given, open_coupled))
    assert outcome.outcome is Outcome.FINISHED, outcome.detail
    return shapes_of(scenario, folder)


def shapes_of(scenario: Scenario, folder: Path) -> tuple[Array, pd.DataFrame]:
    drawn_m = pattern_of(scenario).surface.outer.vertices_m
    _, moved_m = read_shapes(next(folder.rglob(SHAPES)), *drawn_m.shape)
    return moved_m, read_convergence_log(next(folder.rglob(CONVERGENCE_LOG)))


def deepest_m(scenario: Scenario, moved_m: Array) -> float:
    around = surroundings_of(scenario, pattern_of(scenario))
    return max(around.deepest_m(moved) for moved in moved_m)


@pytest.mark.parametrize("scheme", SCHEMES)
def test_a_soft_plank_does_not_go_through_the_floor(scheme: Scheme, tmp_path: Path) -> None:
    # By layers a foam so soft takes a share that its default is refused for.
    loop = {"scheme": scheme, "factor": 5e-4} if scheme == "per_layer" else {"scheme": scheme}
    told = scene(pattern={"loop": loop})
    moved_m, log = driven(told, tmp_path)
    assert (log["contact_n"] > 0.0).any()
    # Asked: 0.1 mm. Solutions are exact, and no interface is led farther than to the floor.
    assert deepest_m(told, moved_m) < 1e-9


def test_the_plank_of_the_finding_lies_on_the_floor_and_the_loop_holds(tmp_path: Path) -> None:
    told = scene(
        pattern={"young_modulus_pa": 3e4, "position_m": [0.0, 0.004],
                 "loop": {"window_s": 0.002, "repeats": 12}},
        fill={"layers": [{"count": 30, "repeat": 2}],
              "settling": {"shortest_s": 0.06}},
    )  # fmt: skip
    moved_m, log = driven(told, tmp_path)
    assert deepest_m(told, moved_m) < 1e-9
    found = classify_loop(log)
    assert found is not None
    assert found.state == "holds"
    last = log.iloc[-1]
    # The floor bears a good part of what lies on the plank, and forces balance.
    assert 0.2 * last.load_n < last.contact_n < last.load_n
    assert last.imbalance_n < 1e-9 * last.load_n
    # Nothing is made: the foam stores what the sand gave less what contact took.
    assert last.energy_j < 1.1 * (last.work_j - last.contact_j)


@pytest.mark.parametrize("scheme", ["fixed", "aitken", "in_step"])
def test_a_plank_on_the_floor_comes_to_rest(scheme: Scheme, tmp_path: Path) -> None:
    told = scene(pattern={"loop": {"scheme": scheme}}, rest=Rest().model_dump())
    moved_m, log = driven(told, tmp_path)
    assert deepest_m(told, moved_m) < 1e-9
    last = log.iloc[-1]
    assert 0.2 * last.load_n < last.contact_n < last.load_n
    # Held until half of the tolerance of loads is left to the way.
    assert last.residual_m < 0.005 * last.displacement_m


@pytest.mark.parametrize("scheme", ["aitken", "in_step"])
def test_a_post_between_two_vertices_holds_the_plank(scheme: Scheme, tmp_path: Path) -> None:
    told = scene(pattern={"loop": {"scheme": scheme}}, obstacles=[POST])
    moved_m, log = driven(told, tmp_path)
    assert (log["contact_n"] > 0.0).any()
    # Places of contact follow the motion of a window or a step: asked are 0.1 mm.
    assert deepest_m(told, moved_m) < 1e-5


@pytest.mark.parametrize("scheme", ["aitken", "in_step"])
def test_contact_moves_with_a_shaken_box(scheme: Scheme, tmp_path: Path) -> None:
    shaken = [{"frequency_hz": 8, "acceleration_g": 1.5, "duration_s": 0.02}]
    stiffer = {"young_modulus_pa": 2e6, "position_m": [0.0, 1e-4]}
    told = scene(pattern={**stiffer, "loop": {"scheme": scheme}}, vibration=shaken)
    moved_m, log = driven(told, tmp_path)
    assert (log[log["time_s"] > log["time_s"].max() - 0.02]["contact_n"] > 0.0).any()
    assert deepest_m(told, moved_m) < 1e-9


def test_a_plank_that_bends_far_lies_on_the_floor(tmp_path: Path) -> None:
    told = scene(pattern={"statics": "large", "young_modulus_pa": 4e5, "position_m": [0.0, 5e-4]})
    moved_m, log = driven(told, tmp_path)
    assert (log["contact_n"] > 0.0).any()
    assert deepest_m(told, moved_m) < 1e-6 * 0.04


def test_foam_too_soft_for_its_load_ends_the_run_in_a_sentence(tmp_path: Path) -> None:
    foam = {"statics": "large", "young_modulus_pa": 30.0, "position_m": [0.01, 0.01]}
    told = scene(pattern=foam, fill={"settling": {"shortest_s": 0.012}})
    outcome = drive(told, tmp_path, lambda *given: Driver(*given, open_coupled))
    assert outcome.outcome is Outcome.NO_EQUILIBRIUM
    assert re.match(r"after .* s the pattern finds no equilibrium beyond", outcome.detail)
    found = verdict_of(tmp_path)
    assert found is None or found.state == "diverged"


def test_in_space_a_soft_plank_lies_on_the_floor(tmp_path: Path) -> None:
    plank = {"position_m": [0.0, 0.0, 0.003], "depth_m": 0.02, "element_m": 0.01}
    told = scene(dimension=3, box={"depth_m": 0.02}, pattern=plank)
    moved_m, log = driven(told, tmp_path)
    assert (log["contact_n"] > 0.0).any()
    assert deepest_m(told, moved_m) < 1e-9
