"""Runs that go on from one fill end as runs that fill by themselves."""

from __future__ import annotations

import fcntl
import json
import os
import shutil
import threading
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd
import pytest
import yaml

from sandmould.definition.run import Run
from sandmould.engines.snapshot import stored_snapshots
from sandmould.execution.again import _failed_fill
from sandmould.execution.jobs import compute_run
from sandmould.execution.packs.pack import pack
from sandmould.execution.packs.unpack import unpack
from sandmould.execution.simulate import render_run, simulate
from sandmould.execution.status import status_text
from sandmould.kinds.sand.kind import SAND
from sandmould.pattern_fe.coupling.interface import with_surface
from sandmould.runs.checkpoint_folders import END_CHECKPOINT, read_mark, seal
from sandmould.runs.outcome import Outcome, RunOutcome
from sandmould.runs.run_tables import read_costs
from sandmould.scenario.scenario import Scenario
from sandmould.study.collect import collect
from sandmould.study.plan.announcement import prepare
from sandmould.study.plan.build_plan import RESULTS, Plan, open_plan
from sandmould.study.plan.fills import share_fills
from sandmould.study.plan.lacking import Need, lack_of
from sandmould.study.plan.plan_files import read_run
from tests.liggghts_scenes import liggghts_scene, needs_liggghts
from tests.patterns import _one_thread  # noqa: F401
from tests.planned import announce, write_plan
from tests.scenes import TUBE_SCENE, tube_scene
from tests.workflow.runs import (
    SOON,
    compute_all,
    computed,
    kill_after_a_checkpoint,
    last_snapshot,
    run_folder,
)
from tests.workflow.test_records_change_nothing import PLANK

REFERENCE: dict[str, Any] = {"engine": {"name": "reference"}, "rest": SOON}


def pair(scene: Scenario, folder: Path) -> tuple[list[Path], Path]:
    """Plan a scene twice, once shaken for longer; give the runs' folders and that of their fill."""
    stage = scene.vibration[0]
    longer = stage.model_copy(update={"duration_s": 2 * stage.duration_s})
    scenes = [scene, scene.model_copy(update={"vibration": (longer, *scene.vibration[1:])})]
    runs = [Run("test", f"run_{i}", {"of": i}, 1, each, {}) for i, each in enumerate(scenes)]
    shared, (fill,) = share_fills(runs, SAND.planning)
    write_plan([*shared, fill], folder)
    return [folder / run.place for run in shared], folder / fill.place


def compute(folder: Path) -> Outcome:
    """Render and compute a run or a fill in this process."""
    render_run(folder)
    assert simulate(folder) == 0
    return RunOutcome.read(folder / "outcome.json").outcome


def lack_of_folder(folder: Path) -> Need:
    return lack_of(read_run(folder / "scenario.yaml"), folder).need


def assert_same(one: Path, other: Path) -> None:
    for table in ("series.tsv", "loads.tsv", "pattern.tsv", "pattern_shapes.f8"):
        assert (one / table).exists() == (other / table).exists()
        if table == "pattern.tsv" and (one / table).exists():  # solve_s is a wall time
            pd.testing.assert_frame_equal(
                *(pd.read_csv(f / table, sep="\t").drop(columns="solve_s", errors="ignore")
                  for f in (one, other))
            )  # fmt: skip
        elif (one / table).exists():
            assert (one / table).read_bytes() == (other / table).read_bytes(), table
    snapshots = [[each.name for each in stored_snapshots(f)] for f in (one, other)]
    assert snapshots[0] == snapshots[1]
    for name in ("position_m", "velocity_m_s", "spin_rad_s", "pattern_m"):
        values = (getattr(last_snapshot(f), name) for f in (one, other))
        np.testing.assert_array_equal(*values, err_msg=name)


@pytest.fixture(scope="module")
def straight(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The shorter run, which fills by itself."""
    return computed(tube_scene(**REFERENCE), tmp_path_factory.mktemp("straight"))


def test_a_branch_is_bit_for_bit_the_run_that_fills_by_itself(
    straight: Path, tmp_path: Path
) -> None:
    (shorter, longer), fill = pair(tube_scene(**REFERENCE), tmp_path)
    assert [compute(folder) for folder in (fill, shorter, longer)] == [Outcome.FINISHED] * 3
    assert_same(shorter, straight)
    costs = {f: read_costs([f]).rows.iloc[-1] for f in (fill, shorter, straight)}
    # each pays for what it computes, and a sum counts the fill once
    own = costs[fill].grain_steps + costs[shorter].grain_steps
    assert own == costs[straight].grain_steps
    assert costs[shorter].steps == costs[straight].steps
    assert costs[shorter].fill == fill.name
    assert "fill" not in costs[fill]
    assert lack_of_folder(fill) is Need.NOTHING
    # what the plan says of the disk
    ends = [*(fill / END_CHECKPOINT).iterdir(), fill / "snapshots.npz"]
    taken = sum(path.stat().st_size for path in ends)
    assert 0.5 < taken / SAND.planning.state_bytes(read_run(fill / "scenario.yaml").scenario) < 2.0
    # the longer one knows nothing of the shorter
    assert RunOutcome.read(longer / "outcome.json").simulated_s > costs[straight].steps * (
        costs[straight].time_step_s
    )


@pytest.mark.parametrize("scheme", ["aitken", "measured", "in_step", "monolithic"])
def test_a_branch_with_a_pattern_too(scheme: str, tmp_path: Path) -> None:
    pattern = {**PLANK["pattern"], "loop": {"scheme": scheme}}
    # slow, since the masses of monolithic must not swing with the box
    shaken = [{"acceleration_g": 0.5, "frequency_hz": 15.0, "duration_s": 0.06}]
    scene = with_surface(tube_scene(**{**PLANK, "pattern": pattern, "vibration": shaken}))
    (shorter, _), fill = pair(scene, tmp_path)
    assert [compute(folder) for folder in (fill, shorter)] == [Outcome.FINISHED] * 2
    assert_same(shorter, computed(scene, tmp_path / "straight"))


def plank_on(make: Callable[..., Scenario], **loop: Any) -> Scenario:
    """A foam plank under ten discs, on the engine of a maker of scenes."""
    plank = {key: value for key, value in PLANK.items() if key != "engine"}
    changes = {
        "pattern": {**PLANK["pattern"], "loop": loop},
        "fill": {"layers": [{"count": 10}]},
        "vibration": [{"acceleration_g": 0.5, "frequency_hz": 15.0, "duration_s": 0.02}],
    }
    return with_surface(make(**{**plank, **changes}))


@pytest.mark.parametrize(
    "scene",
    [
        tube_scene(rest=SOON),
        plank_on(tube_scene, scheme="measured"),
        pytest.param(liggghts_scene(rest={**SOON, "load_tolerance": 0.3}), marks=needs_liggghts),
        pytest.param(plank_on(liggghts_scene, scheme="aitken", repeats=0), marks=needs_liggghts),
    ],
    ids=["lammps", "lammps with a pattern", "liggghts", "liggghts with a pattern"],
)
def test_decks_go_on_from_the_end_of_a_fill(scene: Scenario, tmp_path: Path) -> None:
    """The shaken sand stands where the straight run's does, to what a restart loses."""
    (shorter, _), fill = pair(scene, tmp_path)
    assert [compute(folder) for folder in (fill, shorter)] == [Outcome.FINISHED] * 2
    alone = computed(scene, tmp_path / "straight")
    tables = [pd.read_csv(f / "series.tsv", sep="\t") for f in (shorter, alone)]
    filled = [t[t["vibration_time_s"].isna()] for t in tables]
    pd.testing.assert_frame_equal(*filled)
    shaken = [t[t["vibration_time_s"] > 0].iloc[0] for t in tables]
    assert shaken[0].time_s == shaken[1].time_s
    assert shaken[0].kinetic_energy_j == pytest.approx(shaken[1].kinetic_energy_j, rel=1e-3)


@pytest.mark.parametrize("harm", ["torn", "of another scene", "missing"])
def test_a_fill_that_cannot_be_used_is_told_and_the_run_fills_by_itself(
    harm: str, straight: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    (shorter, longer), fill = pair(tube_scene(**REFERENCE), tmp_path)
    compute(fill)
    if harm == "torn":  # its size is right
        state = fill / END_CHECKPOINT / "solver.npz"
        state.write_bytes(state.read_bytes()[:-100] + bytes(100))
    elif harm == "missing":
        (fill / "outcome.json").unlink()
    else:
        other = tube_scene(**REFERENCE, seed=2)
        (_, _), foreign = pair(other, tmp_path / "other")
        compute(foreign)
        (fill / END_CHECKPOINT).rename(fill / "own")
        (foreign / END_CHECKPOINT).rename(fill / END_CHECKPOINT)
    # Harmed since the start: its run does not wait for another one.
    assert compute(shorter) is Outcome.FINISHED
    assert f"the fill {fill.name} cannot be used" in capsys.readouterr().err
    assert_same(shorter, straight)
    assert "fill" not in read_costs([shorter]).rows
    # The next start makes it again, for the runs that are left.
    assert lack_of_folder(fill) is Need.COMPUTE
    compute_all([fill, longer], tmp_path / "log")
    assert lack_of_folder(fill) is Need.NOTHING
    assert read_costs([longer]).rows["fill"].tolist() == [fill.name]


def test_a_checkpoint_of_another_version_is_told_and_left(tmp_path: Path) -> None:
    folder = run_folder(tube_scene(**REFERENCE, record={"checkpoint_every_s": 0.02}), tmp_path)
    kill_after_a_checkpoint(folder)
    for path in folder.glob("work/checkpoint_*/mark.json"):
        sealed = json.loads(path.read_text())
        del sealed["mark"]["layout"]
        path.write_text(json.dumps(sealed))
    assert compute(folder) is Outcome.FINISHED
    detail = RunOutcome.read(folder / "outcome.json").detail
    assert "cannot be used: another version of Sandmould wrote it" in detail


def test_runs_end_as_the_fill_that_failed(tmp_path: Path) -> None:
    scene = tube_scene(**REFERENCE, guard={"largest_overlap_fraction": 1e-4})
    (shorter, _), fill = pair(scene, tmp_path)
    assert compute(fill) is Outcome.OVERLAP_TOO_LARGE
    assert compute(shorter) is Outcome.OVERLAP_TOO_LARGE
    ended = RunOutcome.read(shorter / "outcome.json")
    assert ended.detail.startswith(f"in the fill {fill.name}, which it shares: an overlap of ")
    assert (shorter / "series.tsv").read_bytes() == (fill / "series.tsv").read_bytes()
    # asked for again, it needs its fill again
    assert _failed_fill(shorter) == [fill]


def test_a_killed_fill_and_a_killed_branch_go_on(straight: Path, tmp_path: Path) -> None:
    record = {"checkpoint_every_s": 0.02}
    (shorter, _), fill = pair(tube_scene(**REFERENCE, record=record), tmp_path)
    for folder in (fill, shorter):
        render_run(folder)
        kill_after_a_checkpoint(folder)
        assert compute(folder) is Outcome.FINISHED
    assert_same(shorter, straight)
    costs = [read_costs([f]).rows.iloc[-1] for f in (fill, shorter, straight)]
    assert costs[0].grain_steps + costs[1].grain_steps == costs[2].grain_steps


def test_two_jobs_never_make_one_fill(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    _, fill = pair(tube_scene(**REFERENCE), tmp_path)
    render_run(fill)
    (fill / "work").mkdir(exist_ok=True)
    RunOutcome(Outcome.FINISHED, "by the other job", 1.0, 1.0).write(tmp_path / "outcome.json")
    with (fill / "lock").open("a") as lock:
        fcntl.flock(lock, fcntl.LOCK_EX)

        def other_job_ends() -> None:
            (tmp_path / "outcome.json").rename(fill / "outcome.json")
            fcntl.flock(lock, fcntl.LOCK_UN)

        threading.Timer(0.3, other_job_ends).start()
        compute_run(fill, str(tmp_path / "log"), 1, "")
    assert "waiting for the process that computes it already" in capsys.readouterr().err
    assert RunOutcome.read(fill / "outcome.json").detail == "by the other job"


@pytest.fixture(scope="module")
def computed_sweep(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Compute a study of two runs that share a fill."""
    place, before = tmp_path_factory.mktemp("sweep"), Path.cwd()
    os.chdir(place)
    tree = {"scenario": {**TUBE_SCENE, **REFERENCE},
            "sweep": {"keys": {"vibration.0.frequency_hz": [50, 100]}}}  # fmt: skip
    Path("small.yaml").write_text(yaml.safe_dump(tree))
    plan = open_plan(Path("small.yaml"))
    announce(plan, RESULTS, 1)
    for runs in (plan.fills, plan.runs):
        compute_all([RESULTS / "small" / run.place for run in runs], place / "log")
    os.chdir(before)
    return place


@pytest.fixture
def sweep(computed_sweep: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Plan:
    """A copy of it, with its plan."""
    shutil.copytree(computed_sweep, tmp_path, dirs_exist_ok=True)
    monkeypatch.chdir(tmp_path)
    return open_plan(Path("small.yaml"))


def test_what_is_lost_of_a_study_is_computed_from_its_fills(sweep: Plan) -> None:
    plan, folder = sweep, RESULTS / "small"
    (fill,), (run, _) = plan.fills, plan.runs
    assert plan.lacks(RESULTS) == {}
    assert "2 done of 2 runs\nprocessor time" in status_text(plan, RESULTS, 1)
    # a torn fill matters only to a run that goes on from it
    (folder / fill.place / END_CHECKPOINT / "solver.npz").write_bytes(b"")
    assert plan.lacks(RESULTS) == {}
    shutil.rmtree(folder / run.place)
    announce(plan, RESULTS, 1)
    assert set(plan.lacks(RESULTS)) == {fill.run, run.run}
    again = f"computed again: {fill.run} (end_checkpoint/solver.npz has 0 of "
    assert prepare(plan, RESULTS).startswith(again)
    compute_all([folder / fill.place, folder / run.place], Path("log").absolute())
    assert plan.lacks(RESULTS) == {}
    # One of the right size, and one of another scenario.
    shutil.rmtree(folder / run.place)
    announce(plan, RESULTS, 1)
    end = folder / fill.place / END_CHECKPOINT
    mark = read_mark(end)
    (end / "solver.npz").write_bytes(bytes((end / "solver.npz").stat().st_size))
    why = "end_checkpoint cannot be used: its files do not match their hashes"
    assert f"computed again: {fill.run} ({why})" in prepare(plan, RESULTS)
    seal(end, replace(mark, scenario_hash=mark.scenario_hash[::-1]))
    why = "end_checkpoint is of another scenario"
    assert f"computed again: {fill.run} ({why})" in prepare(plan, RESULTS)


def test_packed_runs_need_no_fill_and_its_cost_travels(sweep: Plan) -> None:
    plan, folder = sweep, RESULTS / "small"
    (fill,), (_, run) = plan.fills, plan.runs
    collect(folder)
    summary = (folder / "summary.tsv").read_bytes()
    assert b"\tfill_cpu_s" in summary
    end = [*(folder / fill.place / END_CHECKPOINT).iterdir()]
    small = Path("small.zip")
    pack(plan, RESULTS, small)
    shutil.rmtree(RESULTS)
    assert unpack(small, RESULTS) == "small: 2 runs taken"
    announce(plan, RESULTS, 1)
    assert plan.lacks(RESULTS) == {}
    collect(folder)
    assert (folder / "summary.tsv").read_bytes() == summary
    # Engines read the state of a fill: it does not travel, and a run that lacks it makes it again.
    assert not any(file.exists() for file in end)
    shutil.rmtree(folder / run.place)
    announce(plan, RESULTS, 1)
    assert set(plan.lacks(RESULTS)) == {fill.run, run.run}
