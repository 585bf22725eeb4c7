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

from sandmould.execution.pool import PROCESS_NAME
from sandmould.runs.run_tables import read_costs
from sandmould.study.plan.build_plan import open_plan
from tests.workflow.slurm_node import SlurmNode, missing

pytestmark = pytest.mark.skipif(bool(missing()), reason=f"needs Debian's slurmd: {missing()}")
STUDY = """\
based_on: tube
scenario:
  engine: {name: reference}
  sand: {size_scale: 10, size_classes: 3, disc_thickness_m: 0.1}
  time_step: {fraction: 0.8}
  vibration: [{frequency_hz: 50, acceleration_g: 1.5, duration_s: 0.6}]
  record: {snapshot_every_s: 0.1}
sweep: {keys: {vibration.0.frequency_hz: [50, 100]}}
replicates: 2
"""
RANKS = """\
based_on: tube
scenario:
  engine: {name: lammps, ranks: 2}
  sand: {size_scale: 12, size_classes: 3, disc_thickness_m: 0.1}
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


def job_of(pid: int) -> str:
    """Number of the job that a process belongs to."""
    environment = Path(f"/proc/{pid}/environ").read_text(encoding="utf-8").split("\0")
    return dict(each.split("=", 1) for each in environment if each)["SLURM_JOB_ID"]


def study_folder(folder: Path, study: str) -> Path:
    """A place to run a study in, on a partition of jobs of five minutes."""
    folder.mkdir()
    (folder / "small.yaml").write_text(study)
    (folder / "cluster.yaml").write_text("partition: short\n")
    return folder


# Two or so runs share a job, and the queue of an empty node is asked more often.
SANDMOULD = [sys.executable, "-P", str(Path(__file__).with_name("quick_queue.py"))]
COMMAND = [
    *SANDMOULD, "run", "small.yaml", "--cluster", "--", "--config", "batch_wall_s=8",
    "--slurm-init-seconds-before-status-checks", "1", "--latency-wait", "5",
    "--default-resources", "mem_mb=500", "runtime=5",
]  # fmt: skip


def planned_runs(folder: Path) -> list[str]:
    """Names of the runs of a study, whether or not a job has begun any."""
    rows = (folder / "results" / "small" / "runs.tsv").read_text().splitlines()[1:]
    return [row.split("\t")[0] for row in rows]


def start(
    slurm: SlurmNode, folder: Path, log: Path, command: list[str] = COMMAND
) -> subprocess.Popen[bytes]:
    with log.open("wb") as file:
        return subprocess.Popen(
            command, cwd=folder, env=slurm.environment, stdout=file, stderr=file,
            start_new_session=True,
        )  # fmt: skip


def call(slurm: SlurmNode, folder: Path, *command: str) -> subprocess.CompletedProcess[str]:
    return subprocess.run(
        command, cwd=folder, env=slurm.environment, capture_output=True, text=True, timeout=LIMIT_S
    )


@pytest.mark.slow
def test_without_shared_jobs_each_asks_what_the_partition_gives(
    slurm: SlurmNode, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    short = STUDY.replace("size_scale: 10", "size_scale: 16").replace("0.6}", "0.1}")
    folder, log = study_folder(tmp_path / "study", short), tmp_path / "log"
    monkeypatch.chdir(folder)
    run = open_plan(Path("small.yaml")).runs[0]
    alone = [each.replace("batch_wall_s=8", "batch_wall_s=0") for each in COMMAND]
    measures = f"results/small/{run.place}/measures.tsv"
    process = start(slurm, folder, log, [*alone, "--retries", "0", measures])
    told: dict[str, str] = {}
    while process.poll() is None:
        told |= slurm.told("%P %l %k")
        time.sleep(0.2)
    assert process.returncode == 0, log.read_text()
    jobs = [f"{rule}_wildcards_{run.run}" for rule in ("render", "simulate", "measure")]
    jobs.append(f"fill_wildcards_{run.fill}")
    assert sorted(told.values()) == sorted(f"short 5:00 rule_{job}" for job in jobs)


@pytest.mark.slow
def test_a_run_of_two_ranks_gets_two_cores_and_the_time_that_its_partition_allows(
    slurm: SlurmNode, tmp_path: Path
) -> None:
    folder, log = study_folder(tmp_path / "study", RANKS), tmp_path / "log"
    # What the cluster does not have is said once, before anything is submitted.
    (folder / "cluster.yaml").write_text("partition: shrot\n")
    said = call(slurm, folder, *COMMAND).stderr
    assert said == (
        "cluster.yaml: partition = 'shrot' cannot be used: valid is a partition of this cluster: "
        "main, short.\n"
    )
    (folder / "cluster.yaml").write_text("partition: short\n")
    process = start(slurm, folder, log)
    wait_for(lambda: bool(slurm.jobs()), process, log)
    (job,) = slurm.jobs()
    assert slurm.told("%C") == {job: "2"}  # a rank has one core, not as many as the run has
    assert slurm.told("%l %P") == {job: "5:00 short"}
    # What is said is shown at the next look, which may come after the first job.
    asks = "A job asks at most 5.0 min, the limit of partition short. "
    wait_for(lambda: asks in log.read_text(), process, log)
    # Ctrl-C takes the job away without a traceback.
    process.send_signal(signal.SIGINT)
    assert process.wait(LIMIT_S) == 130
    assert "Traceback" not in log.read_text()
    assert log.read_text().endswith("small was stopped: the same command goes on with it.\n")
    assert slurm.jobs() == {}

    # A job that can never begin, of an earlier start on another partition, is told and goes.
    run = planned_runs(folder)[0]
    stuck = slurm.submit(
        "--job-name=sandmould_1", f"--comment=rule_batch_wildcards_{run}", f"--chdir={folder}",
        "--partition=short", "--time=60",
    )  # fmt: skip
    # Slurm gives another reason until its scheduler has looked at the job.
    deadline = time.monotonic() + LIMIT_S
    while slurm.told("%r") != {stuck: "PartitionTimeLimit"}:
        assert time.monotonic() < deadline, slurm.told("%r")
        time.sleep(0.2)
    said = call(slurm, folder, *SANDMOULD, "status", "small.yaml").stdout.splitlines()
    assert "jobs on the cluster: 1 pending (1 PartitionTimeLimit)" in said
    assert (
        f"  job {stuck} asks 1:00:00 and cannot begin as it is: PartitionTimeLimit  {run}" in said
    )
    ran = call(slurm, folder, *COMMAND)
    assert ran.returncode == 0, ran.stdout + ran.stderr
    assert slurm.jobs() == {}
    runs = list((folder / "results" / "small" / "runs").iterdir())
    assert read_costs(runs).rows["ranks"].tolist() == [2]

    # The command as a job of its own, after which no other begins.
    slurm.take_jobs("drain")
    submitted = call(slurm, folder, *[c.replace("--cluster", "--detach") for c in COMMAND])
    (job,) = slurm.jobs()
    assert submitted.stdout.startswith(f"The command is job {job} of the cluster: ")
    again = call(slurm, folder, *COMMAND)
    assert again.returncode == 1
    ends = f"computes small already: scancel {job} ends it.\n"
    assert again.stderr == f"job {job} of the cluster (pending) {ends}"
    said = call(slurm, folder, *SANDMOULD, "status", "small.yaml").stdout
    assert f"\nthe command is job {job}, pending (" in said
    slurm.take_jobs("resume")
    deadline = time.monotonic() + LIMIT_S
    while slurm.jobs():
        assert time.monotonic() < deadline, said
        time.sleep(0.2)
    said = call(slurm, folder, *SANDMOULD, "status", "small.yaml").stdout
    assert "the command was a job, which has ended: " in said
    assert "small/report.html (results/small/logs/driver.log)\n" in said


@pytest.mark.slow
def test_cancelled_jobs_killed_processes_and_a_killed_snakemake_cost_no_finished_run(
    slurm: SlurmNode, tmp_path: Path
) -> None:
    folder = study_folder(tmp_path / "study", STUDY)
    log = tmp_path / "first.log"
    outcomes = folder / "results" / "small" / "runs"

    def done() -> dict[str, int]:
        return {p.parent.name: p.stat().st_mtime_ns for p in outcomes.glob("*/outcome.json")}

    process = start(slurm, folder, log)
    wait_for(lambda: bool(simulating(folder)), process, log)
    running = [job for job, state in slurm.jobs().items() if state == "RUNNING"]
    slurm.cancel(running[0])
    wait_for(lambda: len(done()) >= 1 and bool(simulating(folder)), process, log)
    os.kill(simulating(folder)[0], signal.SIGKILL)
    wait_for(lambda: len(done()) >= 2 and bool(simulating(folder)), process, log)
    slurm.requeue(job_of(simulating(folder)[0]))
    os.killpg(process.pid, signal.SIGKILL)
    process.wait()
    left, finished = slurm.jobs(), done()
    assert len(finished) < 4

    # Jobs of the first start go on; those of the second wait for them in the queue.
    process = start(slurm, folder, tmp_path / "second.log")
    at_once = []
    while process.poll() is None:
        state = slurm.told("%T %k")
        at_once += [
            list(state.values()).count(text) for text in state.values() if "RUNNING" in text
        ]
        time.sleep(0.5)
    assert max(at_once) == 1
    said = (tmp_path / "second.log").read_text()
    assert process.returncode == 0, said
    assert "Jobs of an earlier start go on: " in said
    assert all(job in said.split("go on: ")[1].split(".")[0] for job in left)
    summary = pd.read_csv(folder / "results" / "small" / "summary.tsv", sep="\t")
    assert list(summary.outcome) == ["finished"] * 4
    assert summary.tube_fill_fraction.notna().all()
    assert {run: time_ns for run, time_ns in done().items() if run in finished} == finished
    # No job and no process is left behind.
    assert slurm.jobs() == {}
    assert simulating(folder) == []
    # Four runs and their fills in three jobs.
    assert len(list((folder / "results" / "small" / "batches").iterdir())) <= 3
    shutil.rmtree(folder / "results")
