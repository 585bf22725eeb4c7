"""A wall of the box that moves as a piston."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest

from sandmould.engines.durations import run_s, stage_s
from sandmould.engines.program import StepCounts, build_program
from sandmould.engines.reference.session import ReferenceSession
from sandmould.engines.registry import engine_problem
from sandmould.scenario.checks.scene import problems
from sandmould.scenario.scenario import Scenario
from tests.scenes import tube_scene
from tests.verification.cases.bench import RADIUS_M, Bench, law, scene, stiffness

GRAINS, GAP_M = 5, 2e-5
SPEED_M_S, TIME_S = 0.01, 0.01
WALL_OVER_GRAIN = 0.5
"""Stiffness of a contact with a wall over that of two grains."""


def column(wall: str, dimension: int, frame: str = "box") -> Scenario:
    """Touching grains in a row between the piston, a gap before it, and the wall it faces."""
    axis = 0 if wall in ("left", "right") else dimension - 1
    long_m = 2 * RADIUS_M * GRAINS + GAP_M
    size_m = [long_m if i == axis else 0.04 for i in range(dimension)]
    places = np.full((GRAINS, dimension), 0.02)
    places[:, axis] = RADIUS_M * (1 + 2 * np.arange(GRAINS))
    if wall == "left":
        places[:, axis] += GAP_M
    box = {"width_m": size_m[0], "height_m": size_m[-1], "depth_m": size_m[dimension - 2]}
    piston = {"wall": wall, "velocity_m_s": SPEED_M_S, "duration_s": TIME_S}
    given = scene("reference", dimension, step_s=1e-5, frame=frame,
                  pair=law(dimension, damping_ratio=1.0),
                  wall=law(dimension, damping_ratio=1.0, normal=WALL_OVER_GRAIN))  # fmt: skip
    grains = [{"position_m": x.tolist(), "diameter_m": 2 * RADIUS_M} for x in places]
    fill = given.fill.model_dump() | {"grains": grains, "layers": []}
    return Scenario.model_validate(
        given.model_dump() | {"box": box, "fill": fill, "piston": piston}
    )


@pytest.mark.parametrize("dimension", [2, 3])
@pytest.mark.parametrize("wall", ["top", "left", "right"])
def test_a_pressed_column_bears_the_load_of_springs_in_series(wall: str, dimension: int) -> None:
    given = column(wall, dimension)
    assert problems(given) == []
    with Bench(given) as bench:
        session = bench.session
        press, hold = bench.program.stages[1:]
        session.start_stage(press)
        began = session.snapshot().time_s
        along = 0 if wall in ("left", "right") else dimension - 1
        long_m = 2 * RADIUS_M * GRAINS + GAP_M
        begin, way = (0.0, 1.0) if wall == "left" else (long_m, -1.0)
        surfaces = session.solver.surfaces  # type: ignore[attr-defined]
        while not session.stage_over:
            session.advance(0.0023)
            rows = surfaces.vertices_of(wall)
            gone = SPEED_M_S * (session.time_s - began)
            place = surfaces.arrays.vertices[rows][0, along]
            assert place == pytest.approx(begin + way * gone, abs=1e-12)
        assert gone == pytest.approx(SPEED_M_S * TIME_S, abs=1e-12)
        session.start_stage(hold)
        session.advance(0.2)
        loads = session.surface_loads()
        assert loads is not None
    pressed_m = SPEED_M_S * TIME_S - GAP_M
    spring = stiffness(dimension)
    one_by_one = 2 / (WALL_OVER_GRAIN * spring) + (GRAINS - 1) / spring
    facing = {"top": "floor", "left": "right", "right": "left"}[wall]
    for name, out in ((wall, -way), (facing, way)):
        assert loads[name][along] == pytest.approx(out * pressed_m / one_by_one, rel=1e-6)


def test_the_filled_sand_is_pressed_and_comes_to_rest() -> None:
    piston = {"wall": "top", "velocity_m_s": 0.02, "duration_s": 0.5}
    sand = tube_scene(engine={"name": "reference"}, piston=piston)
    program = build_program(sand)
    names = [stage.name for stage in program.stages]
    assert names == ["settle_1", "settle_2", "press", "hold", "vibrate_1", "rest"]
    counts = StepCounts.of(sand)
    assert program.stages[2].longest_steps(counts) == counts.steps(0.5)
    plain = build_program(tube_scene(engine={"name": "reference"}))
    more_s = run_s(program) - run_s(plain)
    assert more_s == pytest.approx(0.5 + stage_s(program, program.stages[3]))


def test_measures_know_where_the_piston_stands() -> None:
    for velocity_m_s, while_it_moves in ((0.02, 0.08), (-0.02, 0.09)):
        piston = {"wall": "right", "velocity_m_s": velocity_m_s, "duration_s": 0.5}
        sand = tube_scene(obstacles=[], piston=piston)
        for stage, width_m in (
            ("settle_2", 0.08), ("press", while_it_moves), ("hold", 0.08 - 0.5 * velocity_m_s),
            ("vibrate_1", 0.08 - 0.5 * velocity_m_s),
        ):  # fmt: skip
            (right,) = (w for w in sand.scene_in(stage).walls if w.name == "right")
            assert right.point_m[0] == pytest.approx(width_m), stage
    lid = tube_scene(piston={"wall": "top", "velocity_m_s": 0.02, "duration_s": 0.5})
    assert "top" not in [wall.name for wall in lid.scene_in("settle_2").walls]
    (top,) = (wall for wall in lid.scene_in("hold").walls if wall.name == "top")
    assert top.point_m[1] == pytest.approx(0.07)


@pytest.mark.parametrize(
    ("piston", "key", "valid"),
    [
        ({"duration_s": 9.0}, "duration_s", "three of the largest grains stay"),
        ({"wall": "right"}, "duration_s", "a piston that stops before tube_"),
        ({"wall": "front"}, "wall", "top, floor, left or right in 2D"),
    ],
)
def test_what_cannot_be_is_said(piston: dict[str, Any], key: str, valid: str) -> None:
    whole = {"wall": "top", "velocity_m_s": 0.02, "duration_s": 0.5} | piston
    found = problems(tube_scene(piston=whole))
    assert {problem.key for problem in found} == {f"piston.{key}"}
    assert valid in found[0].valid


@pytest.mark.parametrize("engine", ["lammps", "liggghts"])
def test_engines_whose_walls_stand_refuse_it(engine: str) -> None:
    given = tube_scene(engine={"name": engine}, piston={
        "wall": "top", "velocity_m_s": 0.02, "duration_s": 0.5})  # fmt: skip
    refused = engine_problem(given)
    assert refused is not None
    assert (refused.key, refused.value) == ("piston.velocity_m_s", 0.02)
    assert "engine reference has it" in refused.valid


def test_a_run_goes_on_from_the_middle_of_the_way(tmp_path: Path) -> None:
    piston = {"wall": "top", "velocity_m_s": 0.5, "duration_s": 0.1}
    sand = tube_scene(engine={"name": "reference"}, fill={"layers": [{"count": 60}]},
                      piston=piston)  # fmt: skip
    program = build_program(sand)
    straight = ReferenceSession(program)
    straight.insert_layer(1)
    straight.start_stage(program.stages[0])
    straight.advance(0.1)
    straight.start_stage(program.stages[1])
    for _ in range(8):
        straight.advance()
    straight.write_checkpoint(tmp_path)
    resumed = ReferenceSession(program, tmp_path)
    for session in (straight, resumed):
        session.advance(0.04)
    rows = straight.solver.surfaces.vertices_of("top")
    places = [s.solver.surfaces.arrays.vertices[rows] for s in (straight, resumed)]
    assert np.array_equal(*places)
    assert places[0][0, 1] < 0.05
    assert np.array_equal(straight.snapshot().position_m, resumed.snapshot().position_m)
