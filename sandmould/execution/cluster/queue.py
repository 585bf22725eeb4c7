"""Jobs of a study in the queue of Slurm, as ``squeue`` tells them."""

from __future__ import annotations

import getpass
import math
import re
import subprocess
from collections import Counter
from collections.abc import Collection, Sequence
from dataclasses import dataclass
from datetime import datetime
from pathlib import Path
from typing import NamedTuple

from sandmould.bad_input import BadInputError
from sandmould.execution.cluster.settings import LIMIT_S, answer, minutes

_FIELDS = "%i|%T|%r|%M|%l|%N|%C|%S|%k|%j|%Z"
PREFIX = "sandmould"
"""Of names of jobs, by our profile."""
DRIVER = "driver_of_"
"""Before the study's name, in the comment of the job that is the command itself."""
_COMMENT = re.compile(r"rule_[a-z]+_wildcards_(\w+)")
LISTED = 6
JOB_START_S = 10.0
"""What a job takes before it computes anything, about."""
WAITING = ("PENDING", "REQUEUED", "REQUEUE_HOLD")
GOING = ("RUNNING", "CONFIGURING", "COMPLETING", "SUSPENDED", "STOPPED", "RESIZING")
NEVER = (
    "PartitionTimeLimit", "PartitionNodeLimit", "PartitionConfig", "BadConstraints",
    "AccountNotAllowed", "InvalidAccount", "InvalidQOS", "QOSNotAllowed",
    "QOSMaxWallDurationPerJobLimit",
    "AssocMaxWallDurationPerJobLimit", "QOSMaxCpuPerJobLimit", "QOSMaxMemoryPerJob", "JobHeldUser",
    "JobHeldAdmin", "DependencyNeverSatisfied",
)  # fmt: skip
"""Reasons for which a job waits until somebody changes something."""


@dataclass(frozen=True)
class Job:
    """One job of the queue."""

    number: str
    state: str
    reason: str
    """Why it waits, or why it ended."""
    used: str
    asked: str
    """Wall time, as Slurm writes it."""
    nodes: str
    cores: str
    begins: str
    """When it began, or will by what Slurm foresees; ``N/A`` where it does not."""
    comment: str
    name: str
    place: str
    """Folder in which it was submitted."""

    @property
    def run(self) -> str:
        """The run that it computes, or the first of several; empty for another job."""
        match = _COMMENT.fullmatch(self.comment)
        return match[1] if match else ""

    @property
    def lives(self) -> bool:
        """Whether it has not ended."""
        return self.waits or self.goes

    @property
    def waits(self) -> bool:
        """Whether it has not begun."""
        return self.state in WAITING

    @property
    def goes(self) -> bool:
        """Whether it has begun and not ended."""
        return self.state in GOING

    @property
    def waits_for_ever(self) -> bool:
        """Whether it cannot begin as things are."""
        return self.waits and self.reason in NEVER


def live_jobs() -> frozenset[str] | None:
    """Numbers of all jobs of the user that have not ended; None where no Slurm answers."""
    jobs = _jobs()
    return None if jobs is None else frozenset(job.number for job in jobs if job.lives)


def jobs_of(runs: Collection[str]) -> list[Job]:
    """Jobs of some runs, those that ended lately included; none where no Slurm answers."""
    return [job for job in _jobs_here() if job.run in runs]


def driver_of(study: str) -> Job | None:
    """The job that is the command of a study and has not ended; None without one."""
    jobs = [job for job in _jobs_here() if job.comment == DRIVER + study]
    return next((job for job in jobs if job.lives), None)


def _jobs_here() -> list[Job]:
    """Our jobs that were submitted in this folder: others may have runs of the same names."""
    here = str(Path().resolve())
    return [job for job in _jobs() or () if job.name.startswith(PREFIX) and job.place == here]


def _jobs() -> list[Job] | None:
    """All jobs of the user; None where there is no Slurm or it does not answer."""
    try:
        said = answer(["squeue", "-h", "-t", "all", "-u", getpass.getuser(), "-o", _FIELDS])
    except BadInputError:
        return None
    rows = [line.split("|") for line in said.splitlines()]
    return [Job(*row) for row in rows if len(row) == 11]


class Outlook(NamedTuple):
    """What the queue lets a study do."""

    cores: int
    """That compute it, or will."""
    begins_s: float = 0.0
    """Until a run is computed."""
    awaits: str = ""
    """What that waits for, where nobody knows how long."""


def outlook(jobs: Sequence[Job], computes: bool, cores: int, age_s: float = 0.0) -> Outlook:
    """What the queue lets a study do by its jobs, as they were some seconds ago.

    Whether a run is being computed is known otherwise, and how many cores it had before.
    """
    going, waiting = [job for job in jobs if job.goes], [job for job in jobs if job.waits]
    cores = sum(int(job.cores) for job in going) or max(
        [int(job.cores) for job in waiting] or [cores]
    )
    if computes:
        return Outlook(cores)
    if going:
        used_s = 60 * max(minutes(job.used) for job in going) + age_s
        return Outlook(cores, JOB_START_S * math.exp(-used_s / JOB_START_S))
    if known := [job.begins for job in waiting if job.begins[:1].isdigit()]:
        wait = datetime.fromisoformat(min(known)) - datetime.now()
        return Outlook(cores, JOB_START_S + max(0.0, wait.total_seconds()))
    next_one = f"one of {len(waiting)} waiting jobs" if waiting else "the next job"
    return Outlook(cores, JOB_START_S, f"once {next_one} begins")


def end_jobs(jobs: Sequence[Job], earlier: Sequence[Job]) -> str:
    """Take all jobs of a study but earlier ones out of the queue; say which stay, how they end."""
    before, there = {job.number for job in earlier}, [job for job in jobs if job.lives]
    cancel([job for job in there if job.number not in before])
    left = [job.number for job in there if job.number in before and job.state != "COMPLETING"]
    if not left:
        return ""
    named = ", ".join(left)
    return f"Jobs of an earlier start go on: {named}. To end them: scancel {' '.join(left)}"


def cancel(jobs: Sequence[Job]) -> None:
    """Take jobs out of the queue."""
    if jobs:
        numbers = [job.number for job in jobs]
        subprocess.run(["scancel", *numbers], capture_output=True, timeout=LIMIT_S, check=False)


def queue_lines(jobs: Sequence[Job]) -> list[str]:
    """What a person should know of the jobs of a study; nothing where there are none."""
    counts = Counter(job.state.lower() for job in jobs if job.waits or job.goes)
    counts += Counter("out of wall time" for job in jobs if job.state == "TIMEOUT")
    if not counts:
        return []
    reasons = Counter(job.reason for job in jobs if job.waits)
    why = ", ".join(f"{number} {reason}" for reason, number in reasons.most_common())
    parts = [f"{number} {state}" for state, number in counts.items()]
    lines = [f"jobs on the cluster: {', '.join(parts)}{f' ({why})' if why else ''}"]
    stuck = [job for job in jobs if job.waits_for_ever]
    lines += [
        f"  job {job.number} asks {job.asked} and cannot begin as it is: {job.reason}  {job.run}"
        for job in stuck[:LISTED]
    ]
    if len(stuck) > LISTED:
        lines.append(f"  and {len(stuck) - LISTED} more that cannot begin")
    if stuck:
        lines.append("  stop the command, change cluster.yaml (docs/cluster.md), and give it again")
    return lines
