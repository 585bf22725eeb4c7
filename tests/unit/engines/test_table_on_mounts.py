"""A table on mounts through the stages of a run: its periods, its rest, its checkpoints."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd
import pytest

from sandmould.engines.driver import Driver
from sandmould.engines.program import build_program
from sandmould.engines.recording import Recorder
from sandmould.engines.reference.session import ReferenceSession
from sandmould.engines.registry import engine_problem
from sandmould.engines.table_periods import TablePeriod
from sandmould.kinds.sand.measure import add_drive
from sandmould.runs.checkpoint_folders import CheckpointMark
from sandmould.runs.outcome import Outcome
from sandmould.runs.products import TABLE_PERIODS
from sandmould.scenario.scenario import Scenario
from tests.scenes import tube_scene

TABLE = {
    "moment_kg_m": 0.02, "moving_mass_kg": 20.0, "mount_frequency_hz": 12.0,
    "mount_damping_ratio": 0.02, "flask_depth_m": 0.3,
}  # fmt: skip
SHAKE = {"hold": "unbalance", "unbalance": TABLE, "frequency_hz": 50.0, "duration_s": 0.1}
PERIODS = 5


def table_scene(*vibration: dict[str, Any], **changes: Any) -> Scenario:
    """Few grains, which rest soon."""
    return tube_scene(
        **{
            "engine": {"name": "reference"},
            "fill": {"layers": [{"count": 60}]},
            "vibration": list(vibration) or [SHAKE],
            "rest": {"checks": 3},
        }
        | changes
    )


def stages_run(session: ReferenceSession, scenario: Scenario) -> list[list[TablePeriod]]:
    """Compute all stages from the beginning; the periods of each."""
    periods = []
    for stage in build_program(scenario).stages:
        if stage.layer:
            session.insert_layer(stage.layer)
        session.start_stage(stage)
        while not session.stage_over:
            session.advance()
        periods.append(session.table_periods())
        session.end_stage()
    return periods


def test_the_table_stands_moves_and_comes_to_rest() -> None:
    scenario = table_scene()
    session = ReferenceSession(build_program(scenario))
    of_fill, of_vibration, of_rest = stages_run(session, scenario)
    assert (len(of_fill), len(of_vibration), len(of_rest)) == (0, PERIODS, 0)
    assert [p.vibration_time_s for p in of_vibration] == pytest.approx(
        [0.02 * n for n in range(1, PERIODS + 1)]
    )
    largest_m = max(p.largest_displacement_m for p in of_vibration)
    assert session.at_rest
    # 2 % of critical damping would keep it swinging for seconds: the brake has held it
    assert session.steps * session.step_s < 2.0
    now = session.snapshot()
    assert np.abs(session.solver.table_places_m).max() < 0.02 * largest_m
    assert np.sqrt((now.velocity_m_s**2).sum(axis=1).mean()) < scenario.rest.rms_speed_m_s


def test_sand_is_not_at_rest_while_the_table_moves() -> None:
    # the check of loads is off, and one check is enough: the table alone can hold the stage
    soft = SHAKE | {"unbalance": TABLE | {"mount_frequency_hz": 1.0}}
    scenario = table_scene(
        soft,
        rest={"checks": 1, "load_tolerance": None, "rms_speed_m_s": 0.02},
        fill={"layers": [{"count": 60}], "settling": {"shortest_s": 0.005}},
    )
    program = build_program(scenario)
    session = ReferenceSession(program)
    held = []
    for stage in program.stages:
        if stage.layer:
            session.insert_layer(stage.layer)
        session.start_stage(stage)
        while not session.stage_over:
            session.advance()
            if stage is program.stages[-1]:
                held.append("the table still moved at" in session.rest_sentence)
        session.end_stage()
    assert any(held)
    assert not held[-1]
    speed = np.diff(session.solver.table_places_m)[0] / session.step_s
    assert abs(speed) < 0.02


@pytest.mark.parametrize("frame", ["box", "laboratory"])
def test_snapshots_are_relative_to_the_table(frame: str) -> None:
    scenario = table_scene(frame=frame, background_damping={"form": "none"})
    program = build_program(scenario)
    session = ReferenceSession(program)
    session.insert_layer(1)
    for stage in program.stages[:2]:
        session.start_stage(stage)
        while not session.stage_over:
            session.advance()
            if stage is program.stages[1] and session.steps - session._stage_start > 1000:
                break
    assert np.abs(np.diff(session.solver.table_places_m)) > 1e-3 * session.step_s
    moments = [session.snapshot()]
    for _ in range(2):
        session.advance(session.step_s)
        moments.append(session.snapshot())
    before, now, after = moments
    # the central difference of the places is the velocity at a whole step, to round-off over dt
    velocity = (after.position_m - before.position_m) / (2 * session.step_s)
    np.testing.assert_allclose(now.velocity_m_s, velocity, atol=1e-9)


def test_a_later_stage_goes_on_from_where_the_table_is() -> None:
    scenario = table_scene(SHAKE, {"kind": "rest"}, {"kind": "rest"}, SHAKE | {"frequency_hz": 40})
    session = ReferenceSession(build_program(scenario))
    periods = stages_run(session, scenario)
    assert [len(p) for p in periods] == [0, PERIODS, 0, 0, 4, 0]
    assert [p.stage for p in periods[4]] == ["vibrate_4"] * 4
    # the clock of vibration stands in the rests
    assert periods[4][0].vibration_time_s == pytest.approx(0.1 + 0.025, abs=1e-3)
    assert session.at_rest


def test_a_checkpoint_within_a_period_changes_no_digit(tmp_path: Path) -> None:
    scenario = table_scene(rest={"checks": 3, "check_every_s": 0.003})
    program = build_program(scenario)
    straight = ReferenceSession(program)
    straight.insert_layer(1)
    straight.start_stage(program.stages[0])
    while not straight.stage_over:
        straight.advance()
    straight.start_stage(program.stages[1])
    while not (straight.can_checkpoint and straight.table_periods()):
        straight.advance()
    straight.write_checkpoint(tmp_path)
    resumed = ReferenceSession(program, tmp_path)
    for session in (straight, resumed):
        while not session.stage_over:
            session.advance()
    rows = [session.table_periods() for session in (straight, resumed)]
    assert rows[0] == rows[1]
    assert len(rows[0]) >= PERIODS - 2
    one, two = (session.snapshot() for session in (straight, resumed))
    np.testing.assert_array_equal(one.position_m, two.position_m)
    np.testing.assert_array_equal(one.velocity_m_s, two.velocity_m_s)


def test_a_run_writes_its_periods_and_its_drive(tmp_path: Path) -> None:
    scenario = table_scene()
    ended = Driver(build_program(scenario), tmp_path, "test", "hash").run()
    assert ended.outcome is Outcome.FINISHED
    rows = pd.read_csv(tmp_path / "work" / TABLE_PERIODS, sep="\t")
    assert list(rows.stage) == ["vibrate_1"] * PERIODS
    works = rows[["unbalance_work_j", "mount_loss_j", "sand_work_j"]].sum()
    kept = rows.table_energy_j.iloc[-1]
    # 1e-4 of the work: periods begin and end at the nearest step
    assert works.unbalance_work_j == pytest.approx(
        works.mount_loss_j + works.sand_work_j + kept, rel=1e-4
    )
    clock = {"stage": ["settle_1", "vibrate_1", "rest"], "vibration_time_s": [-1.0, 0.0, 0.1]}
    drive = add_drive(scenario, pd.DataFrame(clock), tmp_path / "work")
    assert drive.drive_displacement_m.isna().tolist() == [True, True, False]
    # the mean of the last three of five periods, whose phases differ little
    steady = rows.displacement_m[2:]
    assert steady.min() <= drive.drive_displacement_m[2] * 1.01 <= 1.02 * steady.max()


def test_a_continued_run_cuts_its_periods_back(tmp_path: Path) -> None:
    row = TablePeriod("vibrate_1", 0.02, *[1.0] * 8)
    first = Recorder(tmp_path, 2)
    first.add_periods([row])
    series, loads, trusted = first.sizes()
    first.add_periods([row, row])
    first.close()
    mark = CheckpointMark("", "", 0, 0, series, loads, {}, table_bytes=trusted)
    Recorder(tmp_path, 2, mark).close()
    assert len(pd.read_csv(tmp_path / TABLE_PERIODS, sep="\t")) == 1
    Recorder(tmp_path, 2).close()
    assert not (tmp_path / TABLE_PERIODS).exists()


@pytest.mark.parametrize("engine", ["lammps", "liggghts"])
def test_other_engines_refuse_a_table(engine: str, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(f"sandmould.engines.{engine}.engine.installation_problem", lambda: None)
    problem = engine_problem(table_scene(engine={"name": engine}))
    assert str(problem) == (
        f"vibration.0.hold = 'unbalance' cannot be used: valid is acceleration, velocity or "
        f"displacement on engine {engine}; a table on mounts moves on engine reference alone, "
        "whose runs say with what amplitude."
    )
    assert engine_problem(table_scene()) is None
