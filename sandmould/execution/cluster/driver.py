"""The command of a study as a small job of Slurm: one may log out meanwhile."""

from __future__ import annotations

import os
import shlex
import sys
from collections.abc import Sequence
from pathlib import Path

from sandmould.bad_input import BadInputError, Problem
from sandmould.execution.cluster.queue import DRIVER, PREFIX, driver_of
from sandmould.execution.cluster.settings import Demand, answer, limits, read_cluster
from sandmould.study.plan.build_plan import RESULTS, checked_plan, writing

DEMAND = Demand(ranks=1, cores_a_rank=1, memory_mb=4000)  # most of it for the report
# A minute before its wall time ends the job goes into the queue again and leaves those that it has
# submitted there. At scancel its shell outlives the command, which ends them.
_SCRIPT = (
    "trap 'kill -9 $!; scontrol requeue $SLURM_JOB_ID' USR1; trap : TERM; {command} & "
    "while kill -0 $!; do wait $!; done 2>/dev/null"
)


def submit_driver(path: Path, options: Sequence[str]) -> str:
    """Submit the command of a study with Snakemake's options; say what its job is.

    Raises
    ------
    BadInputError
        Where the study cannot start, a driver of it is there or Slurm does not take this one.
    """
    plan, cluster = checked_plan(path), read_cluster()
    name, longest_min = plan.study.name, limits(cluster).longest_min
    replace_driver(name)
    log = driver_log(name)
    with writing(RESULTS / name):
        log.parent.mkdir(parents=True, exist_ok=True)
        log.touch()
    words = [sys.executable, "-m", "sandmould.cli", "run", str(path), "--", *options]
    job = [
        "sbatch", "--parsable", "-J", f"{PREFIX}_{name}", f"--comment={DRIVER}{name}",
        "-o", str(log), "--open-mode=append", "--requeue", "--signal=B:USR1@60",
        *cluster.sbatch(), *DEMAND.options(longest_min),
        f"--wrap={_SCRIPT.format(command=shlex.join(words))}",
    ]  # fmt: skip
    number = answer(job, "a job of the command itself").strip().split(";")[0]
    return (
        f"The command is job {number} of the cluster: you can log out. sandmould status {path} "
        f"says where it stands, scancel {number} ends it, and what it says goes to {log}."
    )


def replace_driver(study: str) -> None:
    """Forget what the last driver of a study said, unless this process is one.

    Raises
    ------
    BadInputError
        Where another waits or runs in the queue.
    """
    own = os.environ.get("SLURM_JOB_ID")
    job = driver_of(study)
    if job is not None and job.number != own:
        said = f"job {job.number} of the cluster ({job.state.lower()}) computes {study} already"
        ends = f"scancel {job.number} ends it"
        raise BadInputError([Problem("STUDY", study, "", sentence=f"{said}: {ends}")])
    if own is None:
        driver_log(study).unlink(missing_ok=True)


def driver_log(study: str) -> Path:
    """What the driver of a study prints."""
    return RESULTS / study / "logs" / "driver.log"


def driver_lines(study: str) -> list[str]:
    """What a person should know of the driver of a study; nothing where there was none."""
    log = driver_log(study)
    if job := driver_of(study):
        why = f" ({job.reason})" if job.waits else ""
        return [f"the command is job {job.number}, {job.state.lower()}{why}; it writes {log}"]
    if not log.exists():
        return []
    lines = log.read_text(encoding="utf-8", errors="replace").splitlines()
    last = next((line for line in reversed(lines) if line.strip()), "it said nothing")
    return [f"the command was a job, which has ended: {last} ({log})"]
