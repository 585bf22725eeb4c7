"""Jobs of runs in a process that stands by: it does the same, and ends with whom it serves."""

from __future__ import annotations

import os
import signal
import subprocess
import sys
import time
from collections.abc import Iterator
from pathlib import Path

import pytest

from sandmould.execution import standby
from sandmould.execution.process import is_locked
from sandmould.runs.outcome import Outcome, RunOutcome
from sandmould.study.plan.batches import is_done
from tests.scenes import tube_scene
from tests.workflow.runs import SOON
from tests.workflow.test_worker import runs_in

FEW = {"engine": {"name": "reference"}, "fill": {"layers": [{"count": 20}]}, "rest": SOON}
LONG = {
    "vibration": [{"acceleration_g": 1.5, "frequency_hz": 50.0, "duration_s": 3.0}],
    "record": {"checkpoint_every_s": 0.1},
}
COMPILED_S = 300.0
"""What is called for the first time is compiled first, beside other tests."""
JOB = """
import sys
from sandmould.execution.standby import do_job
do_job("compute_batch", sys.argv[2:], sys.argv[1], 1, "mpiexec", 1)
"""
"""As workflow/scripts/batch.py."""


@pytest.fixture
def standing() -> Iterator[set[int]]:
    """Processes that stand by, by their numbers: other tests may have left children too."""
    before = set(children(os.getpid()))
    with standby.standing_by([tube_scene(**FEW)]):
        yield set(children(os.getpid())) - before


def job(folder: Path, runs: list[Path]) -> subprocess.Popen[str]:
    scenarios = [f"{run.relative_to(folder)}/scenario.yaml" for run in runs]
    return subprocess.Popen(
        [sys.executable, "-c", JOB, "log", *scenarios],
        cwd=folder, stderr=subprocess.PIPE, text=True,
    )  # fmt: skip


def wait_for(happened: object) -> None:
    deadline = time.monotonic() + COMPILED_S
    while not happened():  # type: ignore[operator]
        assert time.monotonic() < deadline
        time.sleep(0.01)


@pytest.mark.usefixtures("standing")
def test_a_job_loads_nothing_and_passes_on_folder_and_words(tmp_path: Path) -> None:
    runs = runs_in(tmp_path, 2)
    started = job(tmp_path, runs)
    said = started.communicate(timeout=COMPILED_S)[1]
    assert started.returncode == 0
    assert all(is_done(run) for run in runs)
    assert "one_0: finished." in said
    assert "one_1: finished." in (tmp_path / "log").read_text()
    # all that takes time to import is left to the other process
    heavy = (
        "import sys; import sandmould.execution.standby; print({'numpy', 'yaml'} & {*sys.modules})"
    )
    ran = subprocess.run([sys.executable, "-c", heavy], capture_output=True, text=True)
    assert ran.stdout == "set()\n"


@pytest.mark.usefixtures("standing")
def test_a_job_that_fails_says_why_and_has_its_status(tmp_path: Path) -> None:
    (run,) = runs_in(tmp_path, 1)
    (run / "scenario.yaml").write_text("kind: sand\n")
    started = job(tmp_path, [run])
    said = started.communicate(timeout=COMPILED_S)[1]
    assert started.returncode == 1
    assert "1 of 1 stopped or broke: one_0" in said


@pytest.mark.usefixtures("standing")
def test_a_killed_job_stops_its_run_which_the_next_one_continues(tmp_path: Path) -> None:
    (run,) = runs_in(tmp_path, 1, **LONG)
    first = job(tmp_path, [run])
    wait_for(lambda: list(run.glob("work/checkpoint_*/mark.json")))
    first.kill()
    first.communicate()
    wait_for(lambda: not is_locked(run))
    assert not (run / "outcome.json").exists()
    stopped = RunOutcome.read(run / "work" / "outcome.json")
    assert stopped.outcome is Outcome.OUT_OF_WALL_TIME
    second = job(tmp_path, [run])
    said = second.communicate(timeout=COMPILED_S)[1]
    assert second.returncode == 0, said
    assert RunOutcome.read(run / "outcome.json").outcome is Outcome.FINISHED


def test_a_job_goes_on_by_itself_when_the_process_is_killed(
    standing: set[int], tmp_path: Path
) -> None:
    (run,) = runs_in(tmp_path, 1, **LONG)
    first = job(tmp_path, [run])
    wait_for(lambda: list(run.glob("work/checkpoint_*/mark.json")))
    (ready,) = standing
    os.kill(ready, signal.SIGKILL)
    said = first.communicate(timeout=COMPILED_S)[1]
    assert first.returncode == 0, said
    assert "was killed: this job goes on by itself" in said
    assert is_done(run)


def children(pid: int) -> list[int]:
    """Processes that one has started and that have not ended."""
    lists = Path(f"/proc/{pid}/task").glob("*/children")
    return [int(child) for each in lists for child in each.read_text().split()]


def test_at_the_end_nothing_of_it_is_left(tmp_path: Path) -> None:
    (run,) = runs_in(tmp_path, 1, **LONG)
    with standby.standing_by([tube_scene(**FEW)]):
        place = Path(os.environ[standby.PLACE])
        started = job(tmp_path, [run])
        wait_for(lambda: list(run.glob("work/checkpoint_*/mark.json")))
    started.communicate(timeout=COMPILED_S)
    assert started.returncode == 1
    assert not is_locked(run)  # it was killed with all that it had started
    assert not place.parent.exists()
    assert standby.PLACE not in os.environ
