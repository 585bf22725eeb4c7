"""A gate that opens in a stated time, and a discharge of stated duration."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest

from sandmould.engines.driver import Driver
from sandmould.engines.durations import grain_steps, stage_s
from sandmould.engines.program import StepCounts, build_program
from sandmould.engines.reference.session import ReferenceSession
from sandmould.engines.registry import engine_of, engine_problem
from sandmould.runs.outcome import Outcome
from sandmould.scenario.checks.scene import problems
from sandmould.scenario.scenario import Scenario
from tests.hopper import FLOOR_M, HALF_OUTLET_M, MIDDLE_M, hopper_scene

OPENING_S, DURATION_S = 0.05, 0.08
TIMED = {"opening_time_s": OPENING_S, "duration_s": DURATION_S}


def timed(engine: str = "reference", **changes: Any) -> Scenario:
    return hopper_scene(engine, discharge=changes or TIMED)


def test_the_steps_of_a_timed_discharge_are_those_of_its_times() -> None:
    program = build_program(timed())
    counts = StepCounts.of(program.scenario)
    opening, flow = (s for s in program.stages if s.name in ("open", "discharge"))
    assert opening.longest_steps(counts) == counts.steps(OPENING_S)
    assert opening.longest_steps(counts) + flow.longest_steps(counts) == counts.steps(DURATION_S)
    assert stage_s(program, opening) + stage_s(program, flow) == pytest.approx(DURATION_S)
    assert flow.settling is None
    filled = [s for s in program.stages if s.kind.fills]
    grains = sum(program.counts)
    planned = build_program(program.scenario.model_copy(update={"discharge": None}))
    more = grain_steps(program) - grain_steps(planned)
    assert more == pytest.approx(grains * DURATION_S / counts.step_s)
    assert [s.name for s in program.stages][len(filled) : len(filled) + 2] == ["open", "discharge"]


@pytest.mark.parametrize("dimension", [2, 3])
@pytest.mark.parametrize("upright", [False, True])
def test_the_opening_widens_evenly_until_the_gate_is_gone(dimension: int, upright: bool) -> None:
    long_m, middle = 2 * HALF_OUTLET_M, [0.1, 0.1]
    size = [0.004, long_m] if upright else [long_m, 0.004]
    if dimension == 3:
        middle, size = [0.1, 0.006, 0.1], [size[0], 0.012, size[1]]
    gate = {"kind": "plate", "name": "gate", "centre_m": middle, "size_m": size}
    sand = hopper_scene("reference", dimension=dimension).model_copy(update={"obstacles": ()})
    sand = Scenario.model_validate(
        sand.model_dump() | {"obstacles": [gate], "discharge": TIMED | {"gate": "gate"}}
    )
    session = ReferenceSession(build_program(sand))
    session.insert_layer(1)
    (opening, flow) = (s for s in session._program.stages if s.name in ("open", "discharge"))
    session.start_stage(opening)
    along = dimension - 1 if upright else 0
    begin_s, far_m = session.time_s, middle[along] + long_m / 2
    for _ in range(12):
        place_m = session.solver.surfaces.vertices_of("gate")
        corners_m = session.solver.surfaces.arrays.vertices[place_m]
        share = (session.time_s - begin_s) / (opening.steps * session.step_s)
        opened_m = corners_m[:, along].min() - (far_m - long_m)
        assert opened_m == pytest.approx(long_m * share, abs=2e-6 * long_m)
        assert corners_m[:, along].max() == pytest.approx(far_m, abs=1e-12)
        session.advance(0.0047)
    assert session.stage_over
    session.start_stage(flow)
    assert "gate" not in session.solver.surfaces.names


def test_sand_flows_as_long_as_it_is_told(tmp_path: Path) -> None:
    sand = timed()
    engine = engine_of(sand)
    program = build_program(sand)
    engine.write_deck(program, {}, tmp_path, "test", "test")
    run = Driver(program, tmp_path, "timed", "hash")
    assert run.run().outcome is Outcome.FINISHED
    series = np.genfromtxt(
        tmp_path / "work" / "series.tsv", names=True, dtype=None, encoding="utf-8"
    )
    filled = [s.name for s in program.stages if s.kind.fills]
    begin_s = max(row["time_s"] for row in series if row["stage"] in filled)
    flowed = [row["time_s"] for row in series if row["stage"] in ("open", "discharge")]
    assert max(flowed) - begin_s == pytest.approx(DURATION_S, abs=2 * sand.step_s)


def test_it_opens_from_the_left() -> None:
    session = ReferenceSession(build_program(timed(opening_time_s=0.1)))
    for stage in session._program.stages:
        if stage.layer:
            session.insert_layer(stage.layer)
        session.start_stage(stage)
        if stage.slides:
            break
        while not session.stage_over:
            session.advance()
    session.advance(0.06)
    at = session.snapshot().position_m
    falls = at[:, 1] < FLOOR_M
    assert falls.any()
    assert at[falls, 0].max() < MIDDLE_M + HALF_OUTLET_M / 2


@pytest.mark.parametrize("engine", ["lammps", "liggghts"])
def test_engines_whose_walls_stand_refuse_the_time_alone(engine: str) -> None:
    refused = engine_problem(timed(engine))
    assert refused is not None
    assert (refused.key, refused.value) == ("discharge.opening_time_s", OPENING_S)
    assert "engine reference" in refused.valid
    assert engine_problem(timed(engine, duration_s=DURATION_S)) is None


def test_a_discharge_lasts_longer_than_its_gate_opens() -> None:
    (problem,) = problems(timed(opening_time_s=0.1, duration_s=0.1))
    assert problem.key == "discharge.duration_s"
