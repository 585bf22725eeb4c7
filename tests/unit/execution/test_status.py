"""What is said of a study that is being computed."""

from __future__ import annotations

import fcntl
import json
import os
import socket
from pathlib import Path

import pytest
import yaml

from sandmould.engines.registry import deck_hash
from sandmould.execution.run_study import is_settled, note_settled
from sandmould.execution.status import run_status, status_text
from sandmould.kinds.sand.kind import SAND
from sandmould.runs.claim import CLAIM_FILE
from sandmould.runs.hashing import scenario_hash
from sandmould.runs.manifest import write_manifest
from sandmould.runs.outcome import Outcome, RunOutcome
from sandmould.study.plan.build_plan import RESULTS, Plan, open_plan
from sandmould.study.plan.lacking import Lack, Need
from tests.planned import write_plan

RECORDS = "record.series_every_s"
"""Runs of other records share no fill: test_fills.py has those that do."""


@pytest.fixture
def plan(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Plan:
    """Six runs of one kind, none begun."""
    monkeypatch.chdir(tmp_path)
    tree = {
        "based_on": "tube", "scenario": {"engine": {"name": "reference"}},
        "sweep": {"keys": {RECORDS: [0.01, 0.02, 0.04]}}, "replicates": 2,
    }  # fmt: skip
    Path("trial.yaml").write_text(yaml.safe_dump(tree), encoding="utf-8")
    plan = open_plan(Path("trial.yaml"))
    write_plan(plan.runs, Path("results/trial"))
    return plan


def ended(plan: Plan, place: int, outcome: Outcome, wall_s: float) -> None:
    """Let a run end with all that it leaves; it took so long."""
    run = plan.runs[place]
    folder = Path("results/trial/runs") / run.run
    for name in ("deck.in", "series.tsv", "measures.tsv"):
        (folder / name).write_text("so\n")
    origin = {"scenario_sha256": scenario_hash(run.scenario),
              "template_sha256": deck_hash(run.scenario)}  # fmt: skip
    RunOutcome(outcome, "why it is so", 1.0, 1.0).write(folder / "outcome.json")
    steps = SAND.planning.planned_work(run.scenario)
    cost = {"wall_s": wall_s, "cpu_s": wall_s, "grain_steps": steps}
    write_manifest(folder, "computed", {"series.tsv": 3}, origin, cost)
    code = SAND.planning.measuring_hash
    write_manifest(folder, "measured", {"measures.tsv": 3}, code=code)


def begun(plan: Plan, place: int, ago_s: float) -> Path:
    """Let a run have written its progress a while ago."""
    folder = Path("results/trial/runs") / plan.runs[place].run
    (folder / "work").mkdir()
    progress = {"stage": "settle_1", "time_s": 0.5, "percent": 40.0, "left_s": 90.0, "cpu_s": 20.0}
    path = folder / "work" / "progress.json"
    path.write_text(json.dumps(progress))
    now = path.stat().st_mtime
    os.utime(path, (now, now - ago_s))
    return folder


def claimed(folder: Path) -> None:
    """Let a job on another machine compute a run."""
    (folder / "lock").touch()
    owner = {"host": "node7", "boot": "another", "pid": 1, "job": "7", "token": "t"}
    (folder / CLAIM_FILE).write_text(json.dumps(owner))


@pytest.mark.usefixtures("unmeasured")
def test_time_left_of_nothing_begun_is_an_estimate(plan: Plan) -> None:
    said = status_text(plan, Path("results"), 2)
    assert said.startswith(
        "trial: 6 waiting of 6 runs\nprocessor time so far: 0 s; time left, report included: about "
    )
    assert said.endswith(" on 2 cores, an estimate")


def test_every_state_is_told(plan: Plan) -> None:
    ended(plan, 0, Outcome.FINISHED, 600.0)
    ended(plan, 1, Outcome.OVERLAP_TOO_LARGE, 300.0)
    # A free lock of this machine: stopped, however fresh its progress is.
    running, stopped = begun(plan, 2, ago_s=500.0), begun(plan, 3, ago_s=1.0)
    (stopped / "lock").write_text(f"{socket.gethostname()}\n")
    elsewhere = begun(plan, 4, ago_s=1.0)
    claimed(elsewhere)
    with (running / "lock").open("w") as lock:
        fcntl.flock(lock, fcntl.LOCK_EX)
        said = status_text(plan, Path("results"), 2)
    first, second, *lines = said.splitlines()
    assert first == "trial: 1 done, 1 failed, 2 running, 1 stopped, 1 waiting of 6 runs"
    # 15 min of those that ended, three times 20 s of those that did not.
    # 360 s are left of three, 600 s of the one that waits: on two cores 360 s, then 600 s, then
    # the report.
    left = "time left, report included: about 16.1 min on 2 cores, by finished runs"
    assert second == f"processor time so far: 16.0 min; {left}"
    assert lines == [
        f"  running: {running.name}  40 %, settle_1, 0.5 s simulated",
        f"  running: {elsewhere.name}  40 %, settle_1, 0.5 s simulated, job 7 on node7",
        f"  stopped: {stopped.name}  40 %, settle_1, 0.5 s simulated",
        f"  failed: {plan.runs[1].run}  overlap too large. why it is so",
        "a failed run is computed once more by: sandmould again RUN",
    ]


def test_progress_alone_is_no_run_that_goes_on(plan: Plan) -> None:
    folder = begun(plan, 0, ago_s=500.0)
    (folder / "lock").touch()
    assert run_status(folder, Lack(Need.COMPUTE)).state == "stopped"
    claimed(folder)
    assert run_status(folder, Lack(Need.COMPUTE), {"7"}).state == "running"
    # Its job has ended, as the cluster says, though its claim is fresh; or it ran out of time.
    RunOutcome(Outcome.OUT_OF_WALL_TIME, "", 0.5, 1.0).write(folder / "work" / "outcome.json")
    ended = run_status(folder, Lack(Need.COMPUTE), {"8"})
    assert (ended.state, ended.said[-18:]) == ("stopped", "; out of wall time")
    # Ctrl-C is no lack of time: the run said so itself, or was killed after it had gone on.
    outside = "; stopped from outside, as by Ctrl-C"
    detail = "stopped at 0.5 s because the system asked"
    RunOutcome(Outcome.OUT_OF_WALL_TIME, detail, 0.5, 1.0).write(folder / "work" / "outcome.json")
    assert run_status(folder, Lack(Need.COMPUTE), {"8"}).said.endswith(outside)
    RunOutcome(Outcome.OUT_OF_WALL_TIME, "", 0.5, 1.0).write(folder / "work" / "outcome.json")
    os.utime(folder / "work" / "outcome.json", (1.0, 1.0))
    assert run_status(folder, Lack(Need.COMPUTE), {"8"}).said.endswith(outside)
    (folder / CLAIM_FILE).unlink()
    (folder / "lock").unlink()
    assert run_status(begun(plan, 1, ago_s=0.0), Lack(Need.COMPUTE)).state == "stopped"


def test_a_finished_study_has_nothing_left(plan: Plan) -> None:
    for place in range(6):
        ended(plan, place, Outcome.FINISHED, 60.0)
    said = status_text(plan, Path("results"), 2)
    assert said == "trial: 6 done of 6 runs\nprocessor time so far: 6.0 min; nothing left"


def test_a_study_is_settled_until_a_file_that_snakemake_looks_at_changes(plan: Plan) -> None:
    for place in range(6):
        ended(plan, place, Outcome.FINISHED, 60.0)
    assert not is_settled(plan, RESULTS)
    note_settled(plan, RESULTS)
    assert not is_settled(plan, RESULTS)  # the plan was not written whole
    note_settled(plan, RESULTS)
    assert is_settled(plan, RESULTS)
    folder = RESULTS / "trial"
    (folder / "spent_s.txt").write_text("1.0\n")
    assert is_settled(plan, RESULTS)
    for name in ("summary.tsv", f"runs/{plan.runs[0].run}/outcome.json", "runs.tsv"):
        (folder / name).touch()
        assert not is_settled(plan, RESULTS)
        note_settled(plan, RESULTS)
        assert is_settled(plan, RESULTS)
    (folder / "runs" / plan.runs[0].run / "series.tsv").unlink()
    note_settled(plan, RESULTS)
    assert not is_settled(plan, RESULTS)


def test_broken_files_count_as_not_there(plan: Plan) -> None:
    ended(plan, 0, Outcome.FINISHED, 60.0)
    run = plan.runs[0].run
    (Path("results/trial/runs") / run / "series.tsv").write_text("")
    said = status_text(plan, Path("results"), 2).splitlines()
    assert said[0] == "trial: 6 waiting of 6 runs"
    assert said[2:] == [f"  waiting: {run}  series.tsv has 0 of 3 bytes"]
    progress = begun(plan, 1, ago_s=0.0) / "work" / "progress.json"
    progress.write_text("{")
    assert run_status(progress.parents[1], Lack(Need.COMPUTE)).state == "waiting"
