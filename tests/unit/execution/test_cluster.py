"""What is asked of a cluster and what is said of it, with programs that answer as Slurm does."""

from __future__ import annotations

import os
import sys
from datetime import datetime, timedelta
from pathlib import Path
from typing import Any

import pytest
import yaml
from snakemake.resources import Resources

from sandmould import ROOT
from sandmould.bad_input import BadInputError
from sandmould.execution.cluster.driver import replace_driver, submit_driver
from sandmould.execution.cluster.queue import JOB_START_S, Outlook, end_jobs, jobs_of, outlook
from sandmould.execution.cluster.settings import minutes
from sandmould.execution.cluster.submission import Submission, open_submission
from sandmould.execution.run_study import run_study
from sandmould.execution.status import status_text
from sandmould.study.plan.batches import Batch, read_batches, write_batches
from sandmould.study.plan.build_plan import Plan, open_plan

SLURM = ["--workflow-profile", "slurm"]
PARTITIONS = "main* infinite 64\nshort 1:00:00 16+\nlong 7-00:00:00 64\nlong 7-00:00:00 48\n"


class Slurm:
    """Programs in a folder of their own; they note what they are called with."""

    def __init__(self, folder: Path) -> None:
        self.folder = folder
        folder.mkdir()
        for name in ("sinfo", "sbatch", "squeue", "scancel"):
            program = folder / name
            program.write_text(
                f'#!/bin/sh\necho "$@" >> {folder}/{name}.calls\n'
                f"cat {folder}/{name}.says 2>/dev/null\n"
                f"cat {folder}/{name}.refuses >&2 2>/dev/null && exit 1\nexit 0\n"
            )
            program.chmod(0o755)
            (folder / f"{name}.says").touch()
        self.says("sinfo", PARTITIONS)

    def says(self, program: str, text: str) -> None:
        (self.folder / f"{program}.says").write_text(text)

    def refuses(self, program: str, text: str) -> None:
        (self.folder / f"{program}.refuses").write_text(text)

    def calls(self, program: str) -> list[str]:
        path = self.folder / f"{program}.calls"
        return path.read_text().splitlines() if path.exists() else []

    def job(
        self,
        run: str,
        number: int,
        state: str,
        reason: str,
        asked: str = "1:00",
        begins: str = "N/A",
        comment: str = "rule_batch_wildcards_",
    ) -> str:
        """A line of the queue: of a job of 16 cores that was used for 10 s."""
        told = f"{number}|{state}|{reason}|0:10|{asked}|node7|16|{begins}"
        return f"{told}|{comment}{run}|sandmould_1|{Path.cwd()}\n"


@pytest.fixture
def slurm(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Slurm:
    monkeypatch.setenv("PATH", f"{tmp_path / 'bin'}:{os.environ['PATH']}")
    monkeypatch.chdir(tmp_path)
    return Slurm(tmp_path / "bin")


@pytest.fixture
def plan(slurm: Slurm) -> Plan:
    """Two runs of hours, by the plan."""
    return planned(duration_s=200.0)


def planned(duration_s: float) -> Plan:
    shaken = {"frequency_hz": 50, "acceleration_g": 1.5, "duration_s": duration_s}
    tree = {
        "based_on": "tube",
        "scenario": {"engine": {"name": "reference"}, "vibration": [shaken]},
        "replicates": 2,
    }
    Path("trial.yaml").write_text(yaml.safe_dump(tree))
    return open_plan(Path("trial.yaml"))


def submission(plan: Plan, *stated: str) -> Submission:
    """What a start on Slurm asks for each run in a job of its own; with default resources."""
    resources = Resources.parse([*stated], allow_expressions=True)
    found = open_submission(plan, SLURM, resources)
    found.cores(1)
    found.ask([])
    return found


def cluster(**keys: Any) -> None:
    Path("cluster.yaml").write_text(yaml.safe_dump(keys))


def test_wall_times_as_slurm_writes_them() -> None:
    texts = ["5:00", "1:00:00", "7-00:00:00", "infinite", "n/a"]
    assert [minutes(text) for text in texts] == [5, 60, 7 * 1440, float("inf"), float("inf")]


@pytest.mark.parametrize(
    ("keys", "asked_min", "said"),
    [
        ({}, None, ""),
        ({"partition": "short"}, 60, "at most 60.0 min, the limit of partition short. "),
        ({"partition": "long", "longest_wall_h": 2}, 120, "at most 2.0 h, longest_wall_h of clu"),
        ({"partition": "short", "longest_wall_h": 2}, 60, "the limit of partition short"),
        ({"partition": "long,short"}, 60, "the limit of partition short"),
        ({"longest_wall_h": 1.5}, 90, "longest_wall_h of cluster.yaml"),
    ],
)
def test_the_wall_time_is_capped_by_the_key_and_by_the_partition(
    keys: dict[str, Any], asked_min: int | None, said: str, plan: Plan
) -> None:
    if keys:
        cluster(**keys)
    planned_min = plan.runtime_min(plan.runs[0].run)
    assert planned_min > 120
    found = submission(plan)
    assert found.runtime_min(planned_min) == (asked_min or planned_min)
    assert found.runtime_min(30) == 30  # what is planned shorter asks no more
    assert [each.startswith("A job asks ") and said in each for each in found.said] == [
        True
    ] * bool(said)


def test_a_longer_run_is_told_to_go_on_in_the_next_job(plan: Plan) -> None:
    cluster(partition="short")
    (said,) = submission(plan).said
    jobs = -(-plan.runtime_min(plan.runs[0].run) // 60)
    assert said.endswith(f" It may take {jobs} jobs; each goes on from the last checkpoint.")


def test_slurm_judges_what_will_be_submitted(slurm: Slurm, plan: Plan) -> None:
    cluster(partition="short", account="sand", qos="high", options="--mail-type=END")
    found = submission(plan)
    (call,) = slurm.calls("sbatch")
    for option in ("--test-only", "--partition=short", "--account=sand", "--qos=high",
                   "--mail-type=END", "--time=60"):  # fmt: skip
        assert option in call.split()
    stated = found.resources()
    assert {name: stated[name] for name in ("slurm_partition", "slurm_account", "qos")} == {
        "slurm_partition": "short", "slurm_account": "sand", "qos": "high",
    }  # fmt: skip
    assert found.options(plan.runs[0].run) == "--mail-type=END"


def test_what_the_command_line_states_is_judged_too(slurm: Slurm, plan: Plan) -> None:
    cluster(qos="high")
    found = submission(
        plan, "slurm_partition=short", "slurm_account='sand'", "qos=low", "mem_mb=500"
    )
    (call,) = slurm.calls("sbatch")
    assert {"--partition=short", "--account=sand", "--qos=high", "--time=60"} <= {*call.split()}
    assert found.resources() == {
        "slurm_partition": "short", "slurm_account": "sand", "qos": "high"
    }  # fmt: skip
    # What Snakemake works out for each job is left to it.
    of_job = submission(plan, "constraint='old' if attempt > 1 else 'new'")
    assert of_job.resources() == {"qos": "high"}


def test_a_wrong_partition_and_a_refusal_are_one_sentence(slurm: Slurm, plan: Plan) -> None:
    cluster(partition="shrot")
    with pytest.raises(BadInputError) as told:
        submission(plan)
    assert str(told.value) == (
        "cluster.yaml: partition = 'shrot' cannot be used: valid is a partition of this cluster: "
        "main, short, long."
    )
    assert slurm.calls("sbatch") == []
    cluster(account="nobody")
    slurm.refuses("sbatch", "sbatch: error: Invalid account or partition specified\nallocation\n")
    with pytest.raises(BadInputError) as told:
        submission(plan)
    (said,) = str(told.value).splitlines()
    assert (
        "sbatch says 'Invalid account or partition specified' of a job of 1 cores, as batch_cores "
        in said
    )
    assert "(--account=nobody --time=" in said


def test_new_jobs_wait_for_old_ones_and_those_that_can_never_begin_go(
    slurm: Slurm, plan: Plan
) -> None:
    first, second = (run.run for run in plan.runs)
    slurm.says(
        "squeue",
        slurm.job(first, 4, "RUNNING", "None")
        + slurm.job(first, 5, "PENDING", "Resources")
        + slurm.job(second, 6, "PENDING", "PartitionTimeLimit")
        + slurm.job(second, 7, "COMPLETED", "None"),
    )
    found = submission(plan)
    assert slurm.calls("scancel") == ["6"]
    assert found.said == [
        "Jobs of an earlier start go on: 4, 5. New jobs for their runs begin after them."
    ]
    # So no job holds a node while it waits for another.
    assert found.options(first) == "--dependency=afterany:4:5"
    assert found.options(second) == ""
    assert callable(found.resources()["slurm_extra"])


def test_status_tells_what_waits_and_why_and_what_ran_out_of_time(slurm: Slurm, plan: Plan) -> None:
    first, second = (run.run for run in plan.runs)
    slurm.says(
        "squeue",
        slurm.job(first, 4, "TIMEOUT", "TimeLimit")
        + slurm.job(first, 5, "PENDING", "Priority")
        + slurm.job(second, 6, "PENDING", "QOSMaxWallDurationPerJobLimit", "28-00:00:00")
        + slurm.job("of_another_study_r1_000000", 7, "PENDING", "Priority"),
    )
    said = status_text(plan, Path("results"), 2).splitlines()
    assert said[2:] == [
        "jobs on the cluster: 2 pending, 1 out of wall time "
        "(1 Priority, 1 QOSMaxWallDurationPerJobLimit)",
        "  job 6 asks 28-00:00:00 and cannot begin as it is: QOSMaxWallDurationPerJobLimit  "
        f"{second}",
        "  stop the command, change cluster.yaml (docs/cluster.md), and give it again",
    ]


def test_the_time_left_is_that_of_the_jobs(slurm: Slurm, plan: Plan) -> None:
    first, second = (run.run for run in plan.runs)
    names = [first, second]

    def told(*lines: str, computes: bool = False, age_s: float = 0.0) -> Outlook:
        slurm.says("squeue", "".join(lines))
        return outlook(jobs_of(names), computes, 2, age_s)

    running = [slurm.job(run, 4, "RUNNING", "None") for run in names]
    assert told(*running, computes=True) == Outlook(32)
    # A job that begins needs a while, which never stands still.
    begun = [told(*running, age_s=age_s).begins_s for age_s in (0.0, 1.0, 60.0)]
    assert JOB_START_S > begun[0] > begun[1] > begun[2] > 0.0
    # One that waits begins when Slurm foresees it, or nobody knows.
    soon = (datetime.now() + timedelta(hours=1)).isoformat(timespec="seconds")
    foreseen = told(slurm.job(first, 5, "PENDING", "Resources", begins=soon))
    assert foreseen.begins_s == pytest.approx(3600 + JOB_START_S, abs=5)
    assert (foreseen.cores, foreseen.awaits) == (16, "")
    waiting = [slurm.job(run, 5, "PENDING", "Priority") for run in names]
    assert told(*waiting).awaits == "once one of 2 waiting jobs begins"
    assert told().awaits == "once the next job begins"
    slurm.says("squeue", "".join(waiting))
    said = status_text(plan, Path("results"), 2)
    assert " on 16 cores once one of 2 waiting jobs begins, " in said


def test_the_command_is_a_job_and_no_second_one_starts(
    slurm: Slurm, plan: Plan, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.delenv("SLURM_JOB_ID", raising=False)
    cluster(partition="short", account="sand")
    slurm.says("sbatch", "12\n")
    said = submit_driver(Path("trial.yaml"), SLURM)
    log = "results/trial/logs/driver.log"
    assert said == (
        "The command is job 12 of the cluster: you can log out. sandmould status trial.yaml says "
        f"where it stands, scancel 12 ends it, and what it says goes to {log}."
    )
    (call,) = slurm.calls("sbatch")
    asked = {"--partition=short", "--account=sand", "--time=60", "--cpus-per-task=1", log}
    assert asked <= {*call.split()}
    words = f"{sys.executable} -m sandmould.cli run trial.yaml -- --workflow-profile slurm &"
    assert words in call
    # It waits in the queue.
    slurm.says("squeue", slurm.job("trial", 12, "PENDING", "Priority", comment="driver_of_"))
    lines = status_text(plan, Path("results"), 2).splitlines()
    assert f"the command is job 12, pending (Priority); it writes {log}" in lines
    for start in (submit_driver, run_study):
        with pytest.raises(BadInputError) as told:
            start(Path("trial.yaml"), SLURM)
        assert str(told.value) == (
            "job 12 of the cluster (pending) computes trial already: scancel 12 ends it."
        )
    monkeypatch.setenv("SLURM_JOB_ID", "12")
    replace_driver("trial")  # it is this process
    # It has ended.
    slurm.says("squeue", slurm.job("trial", 12, "FAILED", "None", comment="driver_of_"))
    Path(log).write_text("first\ntrial: 2 of 2 runs done\n\n")
    lines = status_text(plan, Path("results"), 2).splitlines()
    assert f"the command was a job, which has ended: trial: 2 of 2 runs done ({log})" in lines
    # Nothing is left of it once another start has begun.
    monkeypatch.delenv("SLURM_JOB_ID")
    replace_driver("trial")
    assert "the command" not in status_text(plan, Path("results"), 2)


def test_without_slurm_no_job_can_be_submitted(plan: Plan, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("PATH", "nowhere")
    with pytest.raises(BadInputError) as told:
        submit_driver(Path("trial.yaml"), SLURM)
    assert str(told.value).startswith(
        "--cluster = 'Slurm' cannot be used: valid is a machine from which Slurm answers, since "
    )


def test_the_jobs_of_a_start_end_with_it_and_earlier_ones_are_named(
    slurm: Slurm, plan: Plan
) -> None:
    first, second = (run.run for run in plan.runs)
    old = slurm.job(first, 4, "RUNNING", "None") + slurm.job(second, 5, "PENDING", "Priority")
    slurm.says("squeue", old)
    earlier = jobs_of([first, second])
    slurm.says(
        "squeue",
        old
        + slurm.job(first, 6, "PENDING", "Dependency")
        + slurm.job(first, 7, "COMPLETING", "None")
        + slurm.job(second, 8, "RUNNING", "None")
        + slurm.job(second, 9, "COMPLETED", "None"),
    )
    said = end_jobs(jobs_of([first, second]), earlier)
    assert said == "Jobs of an earlier start go on: 4, 5. To end them: scancel 4 5"
    assert slurm.calls("scancel") == ["6 7 8"]
    assert end_jobs([], earlier) == ""


def test_short_runs_take_whole_nodes_by_default(slurm: Slurm) -> None:
    profile = yaml.safe_load((ROOT / "profiles" / "slurm" / "config.yaml").read_text())
    config = dict(each.split("=", 1) for each in profile["config"])
    plan = planned(duration_s=0.1)
    (batch,) = plan.batches(float(config["batch_wall_s"]), cores=int(config["batch_cores"]))
    assert len(batch.runs) == batch.side_by_side == 2
    assert int(config["batch_cores"]) == 32


@pytest.mark.parametrize(
    ("partition", "cores"), [(None, 32), ("short", 16), ("long", 32), ("long,short", 16)]
)
def test_a_job_asks_for_no_more_cores_than_each_node_has(
    partition: str | None, cores: int, slurm: Slurm, plan: Plan
) -> None:
    if partition:
        cluster(partition=partition)
    assert open_submission(plan, SLURM, {}).cores(32) == cores
    slurm.says("sinfo", "main* infinite 2\n")
    (Path("cluster.yaml")).unlink(missing_ok=True)
    assert open_submission(plan, SLURM, {}).cores(32) == 2


def test_jobs_elsewhere_read_which_runs_they_share(plan: Plan, tmp_path: Path) -> None:
    batches = [Batch(plan.runs[0].run, plan.runs, 2)]
    write_batches(batches, tmp_path)
    assert read_batches(plan.runs, tmp_path) == batches
    assert read_batches(plan.runs[1:], tmp_path) == [Batch(plan.runs[0].run, plan.runs[1:], 2)]


def test_another_study_on_this_machine_asks_no_cluster(slurm: Slurm, plan: Plan) -> None:
    Path("cluster.yaml").write_text("partition: [wrong]\n")
    found = open_submission(plan, ["--cores", "2"], {})
    assert found.resources() == {}
    assert found.runtime_min(10**6) == 10**6
    assert slurm.calls("sinfo") == []


def test_a_job_asks_for_as_much_time_each_time_it_is_tried() -> None:
    """Snakemake tells the number of the try to functions that have it as a parameter."""
    rules = [path.read_text() for path in (ROOT / "workflow").rglob("*.smk")]
    assert sum(text.count("runtime=runtime_min_of") for text in rules) == 2
    assert not any("attempt" in text for text in rules)
