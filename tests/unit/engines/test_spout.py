"""Layers that are poured in portions out of a spout that moves over the box."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest

from sandmould.engines.program import StepCounts, build_program
from sandmould.engines.registry import engine_of
from sandmould.scenario.checks.scene import problems
from sandmould.scenario.scenario import Scenario
from tests.liggghts_scenes import SOFT, WHAT_LIGGGHTS_CAN
from tests.scenes import tube_scene

SPOUT = {"from_m": [0.02], "to_m": [0.06], "width_m": 0.03, "time_s": 0.9, "portions": 4}


def poured(engine: str, dimension: int = 2, **changes: Any) -> Scenario:
    """Two layers of twenty grains in a box without obstacles."""
    spout = SPOUT if dimension == 2 else SPOUT | {"from_m": [0.02, 0.05], "to_m": [0.06, 0.03]}
    others = WHAT_LIGGGHTS_CAN if engine == "liggghts" else {"engine": {"name": engine}}
    layers = {"layers": [{"count": 20, "repeat": 2}]}
    return tube_scene(
        **others | {"dimension": dimension, "obstacles": [], "vibration": [], "contact": SOFT,
                    "box": {"depth_m": 0.08}, "fill": layers | {"spout": spout | changes}}
    )  # fmt: skip


def test_a_layer_is_poured_in_portions_and_then_comes_to_rest() -> None:
    program = build_program(poured("reference"))
    kinds = ["pour_1", "pour_2", "pour_3", "settle_4", "pour_5", "pour_6", "pour_7", "settle_8"]
    assert [stage.name for stage in program.stages] == kinds
    assert program.counts == (5,) * 8
    assert program.layer_numbers == [1] * 4 + [2] * 4
    counts = StepCounts.of(program.scenario)
    steps = [stage.longest_steps(counts) for stage in program.stages if stage.settling is None]
    assert steps == [counts.steps(0.3)] * 6
    odd = poured("reference").model_copy(deep=True)
    layers = odd.fill.model_copy(update={"layers": odd.fill.layers[:1]})
    spout = layers.model_copy(update={"spout": layers.spout.model_copy(update={"portions": 3})})
    assert build_program(odd.model_copy(update={"fill": spout})).counts == (6, 7, 7, 6, 7, 7)


@pytest.mark.parametrize("dimension", [2, 3])
@pytest.mark.parametrize("engine", ["reference", "lammps", "liggghts"])
def test_grains_come_out_of_the_spout_where_it_is(
    engine: str, dimension: int, tmp_path: Path
) -> None:
    sand = poured(engine, dimension)
    assert problems(sand) == []
    module, program, spout = engine_of(sand), build_program(sand), sand.fill.spout
    assert spout is not None
    module.write_deck(program, {}, tmp_path, "test", "test")
    session = module.open_session(program, tmp_path, tmp_path / "engine.log")
    begin_s = 0.0
    ends_m = np.array([spout.from_m, spout.to_m])
    for stage in program.stages[:6]:
        session.insert_layer(stage.layer)
        came = session.snapshot()
        new = came.position_m[-5:]
        radius_m = came.radius_m[-5:, None]
        if stage.layer in (1, 5):
            begin_s = came.time_s
        share = (came.time_s - begin_s) / spout.time_s
        middle = ends_m[0] + share * (ends_m[1] - ends_m[0])
        # Steps are whole, so the spout is at most some steps late.
        off = np.abs(new[:, :-1] - middle) + radius_m - spout.width_m / 2
        assert off.max() < 1e-3 * spout.width_m
        assert set(came.layer[-5:]) == {1 if stage.layer < 5 else 2}
        session.start_stage(stage)
        while not session.stage_over:
            session.advance()
        session.end_stage()
    assert session.snapshot().position_m[:, -1].max() < 0.03
    session.close()


@pytest.mark.parametrize(
    ("change", "key", "valid"),
    [
        ({"to_m": [0.07]}, "to_m", "a spout over the box, 0.08 x 0.08 m, with half of width_m"),
        ({"from_m": [0.02, 0.02]}, "from_m", "one number, x, in 2D and two, x and y, in 3D"),
        ({"width_m": 0.001}, "width_m", "at least three of the largest grains"),
        ({"time_s": 0.05}, "time_s", "in which each portion falls before the next"),
    ],
)
def test_what_cannot_be_is_said(change: dict[str, Any], key: str, valid: str) -> None:
    (found,) = problems(poured("reference", **change))
    assert found.key == f"fill.spout.{key}"
    assert valid in found.valid


def test_more_portions_than_grains_or_a_vibrating_box_are_refused() -> None:
    (few,) = problems(poured("reference", portions=40, time_s=50.0))
    assert few.key == "fill.layers"
    assert "one for each portion of fill.spout" in few.valid
    sand = poured("reference")
    shaken = {"vibration": {"acceleration_g": 1.0, "layer_s": 2.0}}
    both = Scenario.model_validate(sand.model_dump() | {"fill": sand.fill.model_dump() | shaken})
    assert [problem.key for problem in problems(both)] == ["fill.spout"]
