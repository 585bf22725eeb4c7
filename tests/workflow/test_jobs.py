"""Runs of one job: each has a process of its own, and what happens to one happens to no other."""

from __future__ import annotations

import os
import signal
import subprocess
import sys
import threading
import time
from collections.abc import Callable, Iterator
from concurrent.futures import ThreadPoolExecutor
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import pytest

from sandmould.definition.run import Run
from sandmould.engines.snapshot import stored_snapshots
from sandmould.execution.jobs import JobError, do_job
from sandmould.execution.locks import is_locked
from sandmould.execution.pool import LOADED_FIRST, start_server
from sandmould.runs.claim import owner_of
from sandmould.runs.outcome import Outcome, RunOutcome
from sandmould.study.plan.batches import is_done
from tests.planned import write_plan
from tests.scenes import tube_scene
from tests.workflow.runs import SOON, compute_all, computed, simulate

FEW: dict[str, Any] = {
    "engine": {"name": "reference"}, "fill": {"layers": [{"count": 20}]}, "rest": SOON,
}  # fmt: skip
LONG: dict[str, Any] = {
    "vibration": [{"acceleration_g": 1.5, "frequency_hz": 50.0, "duration_s": 3.0}],
    "record": {"checkpoint_every_s": 0.1},
}
SOON_S = 300.0
"""What is called for the first time is compiled first, beside other tests."""
JOB = """
import sys
from pathlib import Path
from sandmould.execution.jobs import compute_batch
compute_batch([Path(folder) for folder in sys.argv[2:]], sys.argv[1], 1, "mpiexec")
"""


def runs_in(folder: Path, number: int, **changes: Any) -> list[Path]:
    """Plan runs of a score of grains that differ in their seed."""
    scenes = [tube_scene(seed=seed, **FEW, **changes) for seed in range(1, number + 1)]
    runs = [Run("test", f"one_{n}", {}, 1, scene, {}) for n, scene in enumerate(scenes)]
    write_plan(runs, folder)
    return [folder / "runs" / run.run for run in runs]


def outcome_of(folder: Path) -> RunOutcome:
    return RunOutcome.read(folder / "outcome.json")


def wait_for(happened: Callable[[], object]) -> None:
    deadline = time.monotonic() + SOON_S
    while not happened():
        assert time.monotonic() < deadline
        time.sleep(0.01)


def wait_for_checkpoint(run: Path) -> int:
    """Wait for a run's first checkpoint; gives the process that computes it."""
    wait_for(lambda: list(run.glob("work/checkpoint_*/mark.json")))
    owner = owner_of(run, here=True)
    assert owner is not None
    return owner.pid


@contextmanager
def job_of(folders: list[Path], log: Path) -> Iterator[list[str]]:
    """Compute runs beside the test; gives what the job says at its end."""
    said: list[str] = []

    def job() -> None:
        try:
            compute_all(folders, log)
        except JobError as error:
            said.append(str(error))

    beside = threading.Thread(target=job)
    beside.start()
    yield said
    beside.join()


def started(run: Path, log: Path) -> subprocess.Popen[str]:
    """Start a job of one run, and wait for the run's first checkpoint."""
    command = [sys.executable, "-c", JOB, str(log), str(run)]
    job = subprocess.Popen(command, stderr=subprocess.PIPE, text=True)
    wait_for_checkpoint(run)
    return job


def test_a_crash_takes_no_other_run_and_is_its_runs_outcome(tmp_path: Path) -> None:
    folders = [*runs_in(tmp_path / "long", 1, **LONG), *runs_in(tmp_path, 2)]
    with job_of(folders, tmp_path / "log") as said:
        os.kill(wait_for_checkpoint(folders[0]), signal.SIGSEGV)
    assert said == []
    codes = [Outcome.ENGINE_FAILED, Outcome.FINISHED, Outcome.FINISHED]
    assert [outcome_of(folder).outcome for folder in folders] == codes
    assert outcome_of(folders[0]).detail.startswith("the process ended with status -11: ")
    assert all(is_done(folder) for folder in folders)
    assert "one_1: finished." in (tmp_path / "log").read_text()
    # One file of snapshots: a sweep of thousands of runs must fit on a disk.
    left = {p.relative_to(folders[1]).as_posix() for p in folders[1].rglob("*") if p.is_file()}
    assert left == {
        "scenario.yaml", "deck.in", "layers/layer_1.tsv", "outcome.json", "products.json",
        "series.tsv", "loads.tsv", "snapshots.npz", "measures.tsv", "profile.tsv",
    }  # fmt: skip


def test_a_killed_run_is_continued_and_its_job_goes_on(
    tmp_path: Path, capfd: pytest.CaptureFixture[str]
) -> None:
    folders = [*runs_in(tmp_path / "long", 1, **LONG), *runs_in(tmp_path, 1)]
    with job_of(folders, tmp_path / "log") as said:
        os.kill(wait_for_checkpoint(folders[0]), signal.SIGKILL)
    assert said == ["1 of 2 stopped or broke: one_0"]
    assert "was killed: the same command continues it" in capfd.readouterr().err
    assert [is_done(folder) for folder in folders] == [False, True]
    compute_all(folders, tmp_path / "log", side_by_side=2)
    assert outcome_of(folders[0]).outcome is Outcome.FINISHED


def test_threads_that_ask_for_the_server_leave_the_environment_as_it_was(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    monkeypatch.delenv(LOADED_FIRST, raising=False)
    often = sys.getswitchinterval()
    sys.setswitchinterval(1e-6)
    try:
        with ThreadPoolExecutor(8) as threads:
            list(threads.map(lambda _: start_server(), range(100)))
    finally:
        sys.setswitchinterval(often)
    assert LOADED_FIRST not in os.environ


def test_a_run_that_is_asked_to_end_stops_softly_and_its_job_begins_no_other(
    tmp_path: Path,
) -> None:
    folders = runs_in(tmp_path, 2, **LONG)
    with job_of(folders, tmp_path / "log") as said:
        os.kill(wait_for_checkpoint(folders[0]), signal.SIGTERM)
    assert said == ["2 of 2 stopped or broke: one_0 and one_1"]
    stopped = RunOutcome.read(folders[0] / "work" / "outcome.json")
    assert stopped.outcome is Outcome.OUT_OF_WALL_TIME
    assert not (folders[1] / "work").exists()


def test_without_its_server_a_run_stops_softly_and_the_next_job_continues_it(
    tmp_path: Path,
) -> None:
    (run,) = runs_in(tmp_path, 1, **LONG)
    with job_of([run], tmp_path / "log") as said:
        server = int(Path(f"/proc/{wait_for_checkpoint(run)}/stat").read_text().split()[3])
        os.kill(server, signal.SIGKILL)
    assert said == ["1 of 1 stopped or broke: one_0"]
    wait_for(lambda: not is_locked(run))
    compute_all([run], tmp_path / "log")
    assert outcome_of(run).outcome is Outcome.FINISHED


@pytest.mark.parametrize("number", [signal.SIGKILL, signal.SIGTERM])
def test_runs_of_a_killed_job_are_continued_bit_for_bit(
    number: signal.Signals, tmp_path: Path
) -> None:
    (run,) = runs_in(tmp_path, 1, **LONG)
    job = started(run, tmp_path / "log")
    job.send_signal(number)
    job.communicate()
    wait_for(lambda: not is_locked(run))  # its run ends with it
    assert not (run / "outcome.json").exists()
    stopped = RunOutcome.read(run / "work" / "outcome.json")
    assert stopped.outcome is Outcome.OUT_OF_WALL_TIME
    compute_all([run], tmp_path / "log")
    (straight,) = runs_in(tmp_path / "straight", 1, **LONG)
    compute_all([straight], tmp_path / "log")
    for name in ("series.tsv", "loads.tsv", "snapshots.npz", "measures.tsv"):
        assert (run / name).read_bytes() == (straight / name).read_bytes()


def test_snapshots_of_a_killed_process_are_whole_and_cut_back(tmp_path: Path) -> None:
    (run,) = runs_in(tmp_path, 1, **LONG)
    with job_of([run], tmp_path / "log"):
        os.kill(wait_for_checkpoint(run), signal.SIGKILL)
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
        "import sandmould.execution.preload, os, sys; from pathlib import Path\n"
        "from numba.np.ufunc import parallel\n"
        "bad = {'lammps', 'mpi4py', 'mpich', 'concurrent.futures.process'} & set(sys.modules)\n"
        "maps = Path('/proc/self/maps').read_text()\n"
        "bad |= {name for name in ('libmpi', 'liblammps', 'libomp', 'libgomp') if name in maps}\n"
        "print(len(os.listdir('/proc/self/task')), parallel._is_initialized, sorted(bad))"
    )
    environment = {k: v for k, v in os.environ.items() if k != "OPENBLAS_NUM_THREADS"}
    environment[LOADED_FIRST] = str(tmp_path / "runs" / "one" / "scenario.yaml")
    ran = subprocess.run(
        [sys.executable, "-c", asks], capture_output=True, text=True, env=environment, check=True
    )
    assert ran.stdout == "1 False []\n"


def test_a_run_of_a_job_equals_that_of_a_process_of_its_own(tmp_path: Path) -> None:
    (forked,) = runs_in(tmp_path / "forked", 1)
    compute_all([forked], tmp_path / "log")
    alone = computed(tube_scene(seed=1, **FEW), tmp_path)
    for name in ("series.tsv", "loads.tsv", "snapshots.npz"):
        assert (forked / name).read_bytes() == (alone / name).read_bytes()


def test_a_job_imports_nothing_from_the_folder_where_it_works(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    (run,) = runs_in(tmp_path, 1)
    (tmp_path / "yaml.py").write_text("raise SystemExit('a module of the user')\n")
    command = [sys.executable, "-P", "-c", JOB, "log", str(run)]
    ran = subprocess.run(command, cwd=tmp_path, capture_output=True, text=True)
    assert ran.returncode == 0, ran.stderr


def test_a_job_that_fails_says_why(tmp_path: Path) -> None:
    (run,) = runs_in(tmp_path, 1)
    (run / "scenario.yaml").write_text("kind: sand\n")
    with pytest.raises(JobError, match="1 of 1 stopped or broke: one_0"):
        compute_all([run], tmp_path / "log")
    with pytest.raises(JobError, match="says why"):
        do_job("os:stat", str(tmp_path / "nothing"), log=str(tmp_path / "log"))
    assert "No such file" in (tmp_path / "log").read_text()


def test_a_run_that_cannot_be_loaded_ends_no_server(tmp_path: Path) -> None:
    environment = os.environ | {LOADED_FIRST: str(tmp_path / "nothing" / "scenario.yaml")}
    loads = [sys.executable, "-c", "import sandmould.execution.preload"]
    ran = subprocess.run(loads, env=environment, capture_output=True, text=True)
    assert ran.returncode == 0
    assert "nothing" in ran.stderr
