"""A study on a Slurm of one node: it survives what a cluster does to jobs, and redoes nothing."""

from __future__ import annotations

import os
import shutil
import signal
import subprocess
import sys
import time
from collections.abc import Callable, Iterator
from pathlib import Path

import pandas as pd
import pytest

from sandmould.study.forked import PROCESS_NAME
from sandmould.study.run_tables import read_costs
from tests.workflow.slurm_node import SlurmNode, missing

pytestmark = pytest.mark.skipif(bool(missing()), reason=f"needs Debian's slurmd: {missing()}")
STUDY = """\
based_on: tube
scenario:
  engine: {name: reference}
  sand: {size_scale: 9, size_classes: 3}
  time_step: {fraction: 0.8}
  vibration: [{frequency_hz: 50, acceleration_g: 1.5, duration_s: 1.5}]
  record: {snapshot_every_s: 0.1}
sweep: {keys: {vibration.0.frequency_hz: [25, 50, 100, 200]}}
replicates: 2
"""
RANKS = """\
based_on: tube
scenario:
  engine: {name: lammps, ranks: 2}
  sand: {size_scale: 12, size_classes: 3}
  fill: {layers: [{count: 40}]}
  time_step: {fraction: 0.8}
  vibration: []
"""
LIMIT_S = 240.0


@pytest.fixture
def slurm(tmp_path: Path) -> Iterator[SlurmNode]:
    node = SlurmNode(tmp_path / "slurm")
    node.start()
    yield node
    node.stop()


def wait_for(what: Callable[[], bool], process: subprocess.Popen[bytes], log: Path) -> None:
    deadline = time.monotonic() + LIMIT_S
    while not what():
        assert time.monotonic() < deadline, log.read_text()[-3000:]
        assert process.poll() is None, log.read_text()[-3000:]
        time.sleep(0.05)


def simulating(folder: Path) -> list[int]:
    """Processes that compute a run below a folder."""
    found = []
    for path in Path("/proc").glob("[0-9]*/comm"):
        try:
            name, where = path.read_text().strip(), path.with_name("cwd").readlink()
        except OSError:
            continue
        if name == PROCESS_NAME and where == folder:
            found.append(int(path.parent.name))
    return found


def study_folder(folder: Path, study: str) -> Path:
    """A place to run a study in."""
    folder.mkdir()
    (folder / "small.yaml").write_text(study)
    return folder


# Two or so runs share a job, and the queue of an empty node is asked more often.
COMMAND = [
    sys.executable, "-m", "sandmould.cli", "run", "small.yaml", "--",
    "--workflow-profile", "slurm", "--config", "batch_wall_s=8",
    "--slurm-init-seconds-before-status-checks", "1", "--latency-wait", "5",
    "--default-resources", "mem_mb=500", "runtime=5",
]  # fmt: skip


@pytest.mark.slow
def test_a_run_of_two_ranks_gets_two_cores(slurm: SlurmNode, tmp_path: Path) -> None:
    folder = study_folder(tmp_path / "study", RANKS)
    with (tmp_path / "log").open("wb") as file:
        process = subprocess.Popen(
            COMMAND, cwd=folder, env=slurm.environment, stdout=file, stderr=file,
            start_new_session=True,
        )  # fmt: skip
    wait_for(lambda: bool(slurm.jobs()), process, tmp_path / "log")
    (job,) = slurm.jobs()
    assert slurm.cores(job) == 2  # a rank has one core, not as many as the run has
    assert process.wait(LIMIT_S) == 0, (tmp_path / "log").read_text()[-3000:]
    runs = list((folder / "results" / "small" / "runs").iterdir())
    assert read_costs(runs).rows["ranks"].tolist() == [2]


@pytest.mark.slow
def test_cancelled_jobs_killed_processes_and_a_killed_snakemake_cost_no_finished_run(
    slurm: SlurmNode, tmp_path: Path
) -> None:
    folder = study_folder(tmp_path / "study", STUDY)
    log = tmp_path / "first.log"
    outcomes = folder / "results" / "small" / "runs"

    def done() -> dict[str, int]:
        return {p.parent.name: p.stat().st_mtime_ns for p in outcomes.glob("*/outcome.json")}

    with log.open("wb") as file:
        process = subprocess.Popen(
            COMMAND, cwd=folder, env=slurm.environment, stdout=file, stderr=file,
            start_new_session=True,
        )  # fmt: skip
    wait_for(lambda: bool(simulating(folder)), process, log)
    running = [job for job, state in slurm.jobs().items() if state == "RUNNING"]
    slurm.cancel(running[0])
    wait_for(lambda: len(done()) >= 1 and bool(simulating(folder)), process, log)
    os.kill(simulating(folder)[0], signal.SIGKILL)
    wait_for(lambda: len(done()) >= 2 and bool(simulating(folder)), process, log)
    os.killpg(process.pid, signal.SIGKILL)
    process.wait()
    finished = done()
    assert len(finished) < 8

    ran = subprocess.run(
        COMMAND, cwd=folder, env=slurm.environment, capture_output=True, text=True, timeout=LIMIT_S
    )
    assert ran.returncode == 0, ran.stdout + ran.stderr
    summary = pd.read_csv(folder / "results" / "small" / "summary.tsv", sep="\t")
    assert list(summary.outcome) == ["finished"] * 8
    assert summary.tube_fill_fraction.notna().all()
    assert {run: time_ns for run, time_ns in done().items() if run in finished} == finished
    # No job and no process is left behind.
    assert slurm.jobs() == {}
    assert simulating(folder) == []
    # Eight runs in no more than a handful of jobs.
    assert len(list((folder / "results" / "small" / "batches").iterdir())) <= 4
    shutil.rmtree(folder / "results")
