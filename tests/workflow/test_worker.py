"""Runs of one job: a worker forks for each, and what happens to one happens to no other."""

from __future__ import annotations

import os
import signal
import subprocess
import sys
import time
from pathlib import Path
from typing import Any

import pytest

from sandmould.definition.run import Run
from sandmould.engines.snapshot_file import stored_snapshots
from sandmould.execution import worker
from sandmould.execution.batch_job import compute_batch
from sandmould.execution.process import is_locked
from sandmould.runs.outcome import Outcome, RunOutcome
from sandmould.study.plan.batches import is_done
from sandmould.study.plan.plan_files import write_plan
from tests.scenes import tube_scene
from tests.workflow.runs import SOON, computed, simulate

JOB = """
import sys
from pathlib import Path
import sandmould.runs.one_blas_thread
from sandmould.execution.batch_job import compute_batch
compute_batch([Path(folder) for folder in sys.argv[2:]], Path(sys.argv[1]), 1, "mpiexec")
"""


def runs_in(folder: Path, number: int, **changes: Any) -> list[Path]:
    """Plan runs of a score of grains that differ in their seed."""
    few = {"engine": {"name": "reference"}, "fill": {"layers": [{"count": 20}]}, "rest": SOON}
    scenes = [tube_scene(seed=seed, **few, **changes) for seed in range(1, number + 1)]
    runs = [Run("test", f"one_{n}", {}, 1, scene, {}) for n, scene in enumerate(scenes)]
    write_plan(runs, folder)
    return [folder / "runs" / run.run for run in runs]


def outcome_of(folder: Path) -> RunOutcome:
    return RunOutcome.read(folder / "outcome.json")


def long_job(folder: Path) -> tuple[Path, subprocess.Popen[str]]:
    """Start a job of a run of some seconds, and wait for the run's first checkpoint."""
    stage = {"acceleration_g": 1.5, "frequency_hz": 50.0, "duration_s": 3.0}
    (run,) = runs_in(folder, 1, vibration=[stage], record={"checkpoint_every_s": 0.1})
    command = [sys.executable, "-c", JOB, str(folder / "log"), str(run)]
    job = subprocess.Popen(command, stderr=subprocess.PIPE, text=True)
    deadline = time.monotonic() + 60.0
    while not list(run.glob("work/checkpoint_*/mark.json")):
        assert time.monotonic() < deadline
        assert job.poll() is None
        time.sleep(0.01)
    return run, job


def test_a_crash_takes_no_other_run_and_is_its_runs_outcome(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    folders, simulate = runs_in(tmp_path, 3), worker.simulate

    def crash(folder: Path, run: Run) -> int:
        assert is_locked(folder)
        if folder == folders[1]:
            print("the engine's last words", flush=True)
            os.kill(os.getpid(), signal.SIGSEGV)
        return simulate(folder, run)

    monkeypatch.setattr(worker, "simulate", crash)
    compute_batch(folders, tmp_path / "log", 1, "mpiexec")
    outcomes = [outcome_of(folder) for folder in folders]
    codes = [Outcome.FINISHED, Outcome.ENGINE_FAILED, Outcome.FINISHED]
    assert [outcome.outcome for outcome in outcomes] == codes
    assert outcomes[1].detail == "the process ended with status -11: the engine's last words"
    assert all(is_done(folder) for folder in folders)
    said = (tmp_path / "log").read_text()
    assert "one_1: the engine's last words" in said
    assert "one_2: finished." in said
    # One file of snapshots, one of exports: a sweep of thousands of runs must fit on a disk.
    left = {p.relative_to(folders[0]).as_posix() for p in folders[0].rglob("*") if p.is_file()}
    assert left == {
        "scenario.yaml", "deck.in", "layers/layer_1.tsv", "outcome.json", "products.json",
        "series.tsv", "loads.tsv", "snapshots.npz", "measures.tsv", "profile.tsv", "exports.zip",
        "final.png",
    }  # fmt: skip


def test_a_killed_run_is_continued_and_its_job_goes_on(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capfd: pytest.CaptureFixture[str]
) -> None:
    folders, simulate = runs_in(tmp_path, 2), worker.simulate

    def killed(folder: Path, run: Run) -> int:
        if folder == folders[0]:
            os.kill(os.getpid(), signal.SIGKILL)
        return simulate(folder, run)

    monkeypatch.setattr(worker, "simulate", killed)
    with pytest.raises(SystemExit, match="1 of 2 stopped or broke: one_0"):
        compute_batch(folders, tmp_path / "log", 1, "mpiexec", side_by_side=2)
    assert "was killed: the same command continues it" in capfd.readouterr().err
    assert [is_done(folder) for folder in folders] == [False, True]
    monkeypatch.setattr(worker, "simulate", simulate)
    compute_batch(folders, tmp_path / "log", 1, "mpiexec", side_by_side=2)
    assert outcome_of(folders[0]).outcome is Outcome.FINISHED


@pytest.mark.parametrize("number", [signal.SIGKILL, signal.SIGTERM])
def test_a_killed_or_stopped_worker_is_continued_bit_for_bit(
    number: signal.Signals, tmp_path: Path
) -> None:
    run, job = long_job(tmp_path)
    job.send_signal(number)
    said = job.communicate()[1]
    deadline = time.monotonic() + 30.0
    while is_locked(run):  # its run ends with it
        assert time.monotonic() < deadline
        time.sleep(0.01)
    assert not (run / "outcome.json").exists()
    if number is signal.SIGTERM:
        stopped = RunOutcome.read(run / "work" / "outcome.json")
        assert stopped.outcome is Outcome.OUT_OF_WALL_TIME
        assert "stopped early: the same command continues it" in said
    again = [sys.executable, "-c", JOB, str(tmp_path / "log"), str(run)]
    assert subprocess.run(again, stderr=subprocess.DEVNULL).returncode == 0
    (straight,) = runs_in(tmp_path / "straight", 1, vibration=[
        {"acceleration_g": 1.5, "frequency_hz": 50.0, "duration_s": 3.0}
    ], record={"checkpoint_every_s": 0.1})  # fmt: skip
    compute_batch([straight], tmp_path / "log", 1, "mpiexec")
    for name in ("series.tsv", "loads.tsv", "snapshots.npz", "measures.tsv"):
        assert (run / name).read_bytes() == (straight / name).read_bytes()


def test_snapshots_of_a_killed_process_are_whole_and_cut_back(tmp_path: Path) -> None:
    run, job = long_job(tmp_path)
    (child,) = Path(f"/proc/{job.pid}/task/{job.pid}/children").read_text().split()
    os.kill(int(child), signal.SIGKILL)
    job.communicate()
    torn = (run / "work" / "snapshots.npz").read_bytes()
    stored = stored_snapshots(run / "work")
    assert stored
    for cut in (0, 100, 700):  # in the midst of the last one, too
        (run / "work" / "snapshots.npz").write_bytes(torn[: len(torn) - cut])
        left = stored_snapshots(run / "work")
        assert len(left) in (len(stored), len(stored) - 1)
        assert all(each.load().stage for each in left)
    assert simulate(run) == 0
    numbers = [each.name for each in stored_snapshots(run)]
    assert numbers == [f"{n:06d}" for n in range(len(numbers))]
    times = [each.load().time_s for each in stored_snapshots(run)]
    assert times == sorted(times)


@pytest.mark.parametrize("engine", ["lammps", "liggghts", "reference"])
def test_nothing_that_may_not_be_forked_is_loaded_before_the_fork(
    engine: str, tmp_path: Path
) -> None:
    pattern = {
        "shape": {"kind": "l_shape", "thickness_m": 0.01, "height_m": 0.03, "reach_m": 0.03},
        "position_m": [0.01, 0.0],
    }
    scene = tube_scene(engine={"name": engine}, obstacles=[], pattern=pattern)
    write_plan([Run("test", "one", {}, 1, scene, {})], tmp_path)
    asks = (
        "import sandmould.runs.one_blas_thread, os, sys; from pathlib import Path\n"
        "from sandmould.study.plan.plan_files import read_run\n"
        "from sandmould.execution.worker import load\n"
        f"load(read_run(Path({str(tmp_path / 'runs' / 'one' / 'scenario.yaml')!r})).scenario)\n"
        "from numba.np.ufunc import parallel\n"
        "bad = {'lammps', 'mpi4py', 'mpich', 'concurrent.futures.process'} & set(sys.modules)\n"
        "maps = Path('/proc/self/maps').read_text()\n"
        "bad |= {name for name in ('libmpi', 'liblammps', 'libomp', 'libgomp') if name in maps}\n"
        "print(len(os.listdir('/proc/self/task')), parallel._is_initialized, sorted(bad))"
    )
    environment = {k: v for k, v in os.environ.items() if k != "OPENBLAS_NUM_THREADS"}
    ran = subprocess.run(
        [sys.executable, "-c", asks], capture_output=True, text=True, env=environment, check=True
    )
    assert ran.stdout == "1 False []\n"


def test_a_forked_run_equals_that_of_a_process_of_its_own(tmp_path: Path) -> None:
    (forked,) = runs_in(tmp_path / "forked", 1)
    compute_batch([forked], tmp_path / "log", 1, "mpiexec")
    few = {"engine": {"name": "reference"}, "fill": {"layers": [{"count": 20}]}, "rest": SOON}
    alone = computed(tube_scene(seed=1, **few), tmp_path)
    for name in ("series.tsv", "loads.tsv", "snapshots.npz"):
        assert (forked / name).read_bytes() == (alone / name).read_bytes()
