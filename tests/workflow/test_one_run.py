"""One run from its folder: settling, loads, kill and resume, guards, ranks."""

from __future__ import annotations

import fcntl
import json
import math
import os
import signal
import subprocess
import sys
import threading
import time
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd
import pytest

from sandmould import ROOT
from sandmould.engines.checkpoint import newest_checkpoint
from sandmould.engines.driver import Driver
from sandmould.engines.guard import grain_masses_kg
from sandmould.engines.lammps.render import write_deck
from sandmould.engines.outcome import Outcome, RunOutcome
from sandmould.engines.products import finish
from sandmould.engines.program import build_program
from sandmould.engines.session import RefusedError
from sandmould.engines.snapshot import Snapshot
from sandmould.scenario.scenario import Scenario
from sandmould.study.expand import Run, expand, scenario_hash
from sandmould.study.launch import RESTARTABLE_EXIT, _only_one, launch
from sandmould.study.opening import open_study
from sandmould.study.plan import write_plan
from sandmould.study.simulate import render_run
from tests.scenes import open_lammps, tube_scene


def run_folder(scenario: Scenario, folder: Path) -> Path:
    """Plan and render one run, as the workflow does."""
    run = Run("test", "one", {}, 1, scenario, {})
    write_plan([run], folder)
    render_run(folder / "runs" / "one")
    return folder / "runs" / "one"


def simulate(folder: Path) -> int:
    """Compute a run in a process of its own."""
    command = [sys.executable, "-m", "sandmould.study.simulate", str(folder)]
    return subprocess.run(command, capture_output=True, text=True).returncode


def kill_after_a_checkpoint(folder: Path) -> None:
    """Start a run and kill it as soon as it has left a checkpoint."""
    process = subprocess.Popen(
        [sys.executable, "-m", "sandmould.study.simulate", str(folder)],
        stdout=subprocess.DEVNULL,
        stderr=subprocess.DEVNULL,
    )
    deadline = time.monotonic() + 60
    while not list(folder.glob("work/checkpoint_*/mark.json")):
        assert time.monotonic() < deadline
        assert process.poll() is None
        time.sleep(0.01)
    os.kill(process.pid, signal.SIGKILL)
    process.wait()
    assert not (folder / "outcome.json").exists()
    marks = [json.loads(p.read_text())["mark"] for p in folder.glob("work/checkpoint_*/mark.json")]
    assert max(m["steps"] for m in marks) > 0


def drive(scenario: Scenario, folder: Path) -> RunOutcome:
    """Compute a run in this process."""
    program = build_program(scenario)
    write_deck(program, {}, folder, "test", "test")
    driver = Driver(program, folder, "test", scenario_hash(scenario))
    outcome = driver.run()
    if not outcome.outcome.restartable:
        finish(folder, scenario.dimension, outcome, driver.cost, {})
    return outcome


def last_snapshot(folder: Path) -> Snapshot:
    return Snapshot.load(max((folder / "snapshots").glob("*.npz")))


@pytest.fixture(scope="module")
def straight(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Compute the small scene without a stop."""
    folder = run_folder(tube_scene(), tmp_path_factory.mktemp("straight"))
    assert simulate(folder) == 0
    return folder


def test_run_leaves_all_its_products_and_no_work(straight: Path) -> None:
    names = {p.name for p in straight.iterdir()}
    assert {"outcome.json", "cost.tsv", "series.tsv", "loads.tsv", "provenance.json",
            "snapshots", "engine.log", "deck.in"} <= names  # fmt: skip
    assert "work" not in names
    outcome = RunOutcome.read(straight / "outcome.json")
    assert outcome.outcome is Outcome.FINISHED
    cost = pd.read_csv(straight / "cost.tsv", sep="\t").iloc[0]
    assert cost.grains == 120
    assert 60 * cost.steps < cost.grain_steps < 120 * cost.steps
    assert 0 < cost.engine_wall_s < cost.wall_s
    assert cost.time_step_fraction == pytest.approx(0.5)


def test_next_layer_enters_only_after_the_last_met_its_rule(straight: Path) -> None:
    series = pd.read_csv(straight / "series.tsv", sep="\t")
    settling = tube_scene().fill.settling
    for stage, grains in (("settle_1", 60), ("settle_2", 120)):
        rows = series[series.stage == stage]
        assert set(rows.grains) == {grains}
        assert rows.rms_speed_m_s.iloc[-1] < settling.rms_speed_m_s
        earlier = rows[rows.time_s > rows.time_s.iloc[0] + settling.shortest_s].iloc[:-1]
        assert (earlier.rms_speed_m_s >= settling.rms_speed_m_s).all()


def test_vibration_has_snapshots_at_both_its_ends(straight: Path) -> None:
    times = [Snapshot.load(p).vibration_time_s for p in sorted((straight / "snapshots").iterdir())]
    assert 0.0 in times
    assert times[-1] == pytest.approx(0.06, abs=5 * tube_scene().step_s)


def test_weight_of_a_bed_at_rest_is_the_load_on_floor_walls_and_tube(tmp_path: Path) -> None:
    scene = tube_scene(
        fill={"layers": [{"count": 100}], "settling": {"rms_speed_m_s": 1e-5, "longest_s": 4.0}},
        vibration=[],
    )
    session = open_lammps(scene, tmp_path)
    session.insert_layer(1)
    session.start_stage(session._program.stages[0])
    while not session.stage_over:
        session.advance()
    loads = session.surface_loads()
    weight = grain_masses_kg(scene, session.snapshot()).sum() * scene.gravity_m_s2
    session.close()
    assert session.at_rest
    assert loads is not None
    vertical = sum(force[1] for force in loads.values())
    assert vertical == pytest.approx(-weight, rel=1e-3)
    assert loads["tube_upper"][1] < 0  # the tube carries a part, pressed down
    sideways = sum(force[0] for force in loads.values())
    assert abs(sideways) < 1e-3 * weight
    assert loads["left"][0] < 0 < loads["right"][0]  # the sand pushes both walls outwards


def _state(folder: Path) -> dict[str, Any]:
    snapshot = last_snapshot(folder)
    return {"position": snapshot.position_m, "velocity": snapshot.velocity_m_s,
            "spin": snapshot.spin_rad_s}  # fmt: skip


def test_killed_run_resumes_and_ends_as_if_never_stopped(straight: Path, tmp_path: Path) -> None:
    folder = run_folder(tube_scene(), tmp_path)
    kill_after_a_checkpoint(folder)
    assert simulate(folder) == 0
    for name, values in _state(straight).items():
        np.testing.assert_array_equal(values, _state(folder)[name])
    for table in ("series.tsv", "loads.tsv"):
        assert (folder / table).read_text() == (straight / table).read_text()
    assert len(list((folder / "snapshots").iterdir())) == len(
        list((straight / "snapshots").iterdir())
    )
    costs = [pd.read_csv(f / "cost.tsv", sep="\t").iloc[0] for f in (straight, folder)]
    assert costs[0].grain_steps == costs[1].grain_steps


def test_damaged_checkpoint_is_told_and_the_run_starts_from_the_one_before(
    tmp_path: Path,
) -> None:
    scene = tube_scene(guard={"wall_limit_s": 0.5})
    folder = run_folder(scene, tmp_path)
    assert simulate(folder) == RESTARTABLE_EXIT
    assert RunOutcome.read(folder / "work" / "outcome.json").outcome is Outcome.OUT_OF_WALL_TIME
    newest = max(folder.glob("work/checkpoint_*/lammps.restart"), key=lambda p: p.stat().st_mtime)
    newest.write_bytes(newest.read_bytes()[:1000])
    program = build_program(tube_scene())
    outcome = Driver(program, folder, "test", scenario_hash(scene)).run()
    assert outcome.outcome is Outcome.FINISHED
    assert "cannot be used" in outcome.detail


def test_checkpoint_of_another_scenario_is_left_alone(tmp_path: Path) -> None:
    folder = run_folder(tube_scene(guard={"wall_limit_s": 0.5}), tmp_path)
    assert simulate(folder) == RESTARTABLE_EXIT
    newest, _ = newest_checkpoint(folder / "work")
    assert newest is not None
    kept = {p.name: p.read_bytes() for p in newest[0].iterdir()}
    other = Driver(build_program(tube_scene()), folder, "test", "another").run()
    assert other.outcome is Outcome.FINISHED
    assert "checkpoints of another scenario were set aside" in other.detail
    (aside,) = folder.glob("checkpoints_of_*")
    assert {p.name: p.read_bytes() for p in (aside / newest[0].name).iterdir()} == kept


@pytest.mark.parametrize(
    ("changes", "outcome", "says"),
    [
        ({"guard": {"largest_overlap_fraction": 0.01}}, Outcome.OVERLAP_TOO_LARGE, "0.01"),
        ({"fill": {"layers": [{"count": 60}], "settling": {"longest_s": 0.06}}},
         Outcome.NOT_SETTLED, "layer 1"),
        ({"contact": {"grain_wall": {"normal_stiffness_n_m": 5.0}}, "guard":
          {"largest_overlap_fraction": 2.0}}, Outcome.LOST_GRAINS, "centre in or behind a wall"),
    ],
)  # fmt: skip
def test_guards_end_a_run_with_the_outcome_that_fits(
    changes: dict[str, Any], outcome: Outcome, says: str, tmp_path: Path
) -> None:
    ended = drive(tube_scene(**changes), tmp_path)
    assert ended.outcome is outcome
    assert says in ended.detail
    assert (tmp_path / "outcome.json").exists()
    assert (tmp_path / "series.tsv").exists()


def test_time_step_past_the_critical_one_is_called_unstable(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    # A step that the checks would refuse, so that the guard has something to catch.
    monkeypatch.setattr(Scenario, "step_s", property(lambda s: 4 * s.critical_step.step_s))
    ended = drive(tube_scene(guard={"largest_overlap_fraction": 2.0}), tmp_path)
    assert ended.outcome in (Outcome.UNSTABLE, Outcome.LOST_GRAINS, Outcome.OVERLAP_TOO_LARGE)


def test_two_ranks_fill_the_same_bed(straight: Path, tmp_path: Path) -> None:
    scene = tube_scene(engine={"ranks": 2})
    folder = run_folder(scene, tmp_path)
    launch(folder, tmp_path / "log", ranks=2)
    outcome = RunOutcome.read(folder / "outcome.json")
    assert outcome.outcome is Outcome.FINISHED, outcome.detail
    # Sums run in another order, so grains part after a few collisions; the bed as a whole does not.
    one, two = last_snapshot(straight), last_snapshot(folder)
    assert len(two.id) == 120
    assert two.position_m[:, 1].mean() == pytest.approx(one.position_m[:, 1].mean(), rel=0.1)


@pytest.mark.parametrize(
    ("command", "says"),
    [("no_such_command", "no_such_command"), ('shell "kill -SEGV $PPID"', "status -11")],
)
def test_engine_error_and_crash_leave_an_outcome(command: str, says: str, tmp_path: Path) -> None:
    folder = run_folder(tube_scene(), tmp_path)
    broken = f"#--- block: header --- broken\n{command}\n#--- end: header ---\n"
    (folder / "deck.in").write_text(broken)
    launch(folder, tmp_path / "log")
    ended = RunOutcome.read(folder / "outcome.json")
    assert ended.outcome is Outcome.ENGINE_FAILED
    assert says in ended.detail
    assert (folder / "series.tsv").exists()


def test_paper_size_tube_starts_stops_and_resumes(tmp_path: Path) -> None:
    run = expand(open_study(ROOT / "config" / "studies" / "tube_paper.yaml"))[0]
    assert sum(build_program(run.scenario).counts) == 64_000
    guard = run.scenario.guard.model_copy(update={"wall_limit_s": 0.1})
    folder = run_folder(run.scenario.model_copy(update={"guard": guard}), tmp_path)
    steps = []
    for _ in range(2):
        assert simulate(folder) == RESTARTABLE_EXIT
        newest, damaged = newest_checkpoint(folder / "work")
        assert newest is not None
        assert not damaged
        steps.append(newest[1].steps)
    assert 0 < steps[0] < steps[1]
    assert newest[1].cost["grains"] == 8000


@pytest.mark.parametrize(
    "changes",
    [
        {},
        {"frame": "laboratory"},
        {
            "dimension": 3,
            "box": {"depth_m": 0.06},
            "time_step": {"fraction": 0.9},
            "fill": {"layers": [{"count": 60}], "settling": {"rms_speed_m_s": 0.3}},
        },
    ],
    ids=["box", "laboratory", "3D with turned facets"],
)
def test_restored_session_equals_the_one_that_wrote_the_checkpoint(
    changes: dict[str, Any], tmp_path: Path
) -> None:
    scene = tube_scene(**changes)
    session = open_lammps(scene, tmp_path)
    session.insert_layer(1)
    session.start_stage(session._program.stages[0])
    while not session.stage_over:
        session.advance()
    session.end_stage()
    session.start_stage(session._program.stages[-1])
    while not session.can_checkpoint:
        session.advance()
    session.write_checkpoint(tmp_path)
    restored = open_lammps(scene, tmp_path, checkpoint=tmp_path)
    steps = session.steps
    while session.steps < steps + 1000 and not session.stage_over:
        session.advance()
        restored.advance()
    one, two = session.snapshot(), restored.snapshot()
    loads = session.surface_loads(), restored.surface_loads()
    session.close()
    restored.close()
    assert one.time_s == two.time_s
    assert one.vibration_time_s == two.vibration_time_s
    for name in ("position_m", "velocity_m_s", "spin_rad_s"):
        np.testing.assert_allclose(getattr(one, name), getattr(two, name), rtol=0, atol=1e-9)
    for surface, force in (loads[0] or {}).items():
        np.testing.assert_allclose(force, (loads[1] or {})[surface], atol=1e-6)


def test_a_second_process_waits_for_the_first_and_takes_its_outcome(tmp_path: Path) -> None:
    folder = run_folder(tube_scene(), tmp_path)
    kept = RunOutcome(Outcome.FINISHED, "by the first", 1.0, 1.0)
    with (folder / "lock").open("w") as file:
        fcntl.flock(file, fcntl.LOCK_EX)

        def finish_and_release() -> None:
            kept.write(folder / "outcome.json")
            file.close()

        threading.Timer(0.5, finish_and_release).start()
        with _only_one(folder):
            assert RunOutcome.read(folder / "outcome.json").detail == "by the first"
    launch(folder, tmp_path / "log")
    assert RunOutcome.read(folder / "outcome.json").detail == "by the first"


def test_session_advances_by_a_duration_in_a_folder_with_spaces(tmp_path: Path) -> None:
    folder = tmp_path / "a study of ours"
    folder.mkdir()
    scene = tube_scene(fill={"layers": [{"count": 20}]})
    session = open_lammps(scene, folder)
    session.insert_layer(1)
    session.start_stage(session._program.stages[0])
    session.advance(0.0123)
    steps = session.steps
    session.advance()
    session.write_checkpoint(folder)
    restored = open_lammps(scene, folder, checkpoint=folder)
    assert steps == math.ceil(0.0123 / scene.step_s)
    assert session.steps == restored.steps > steps
    with pytest.raises(RefusedError, match="a polygon or a mesh on engine lammps"):
        session.move_surface("floor", np.zeros((2, 2)), 0.01)
    with pytest.raises(RefusedError, match="a surface moved by move_surface on engine lammps"):
        session.attach_elastic_surface("floor", np.eye(2), np.ones(2), np.ones(2))
    session.close()
    restored.close()
