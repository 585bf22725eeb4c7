"""Jobs of a study in the queue of Slurm, as ``squeue`` tells them."""

from __future__ import annotations

import getpass
import re
import shutil
import subprocess
from collections import Counter
from collections.abc import Collection, Sequence
from dataclasses import dataclass
from pathlib import Path

_FIELDS = "%i|%T|%r|%M|%l|%N|%j|%k|%Z"
_LIMIT_S = 60.0
_PREFIX = "sandmould"
"""Of names of jobs, by our profile."""
_COMMENT = re.compile(r"rule_[a-z]+_wildcards_(\w+)")
LISTED = 6
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
    run: str
    """The run that it computes, or the first of several."""

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
    said = _squeue("%i|%T")
    if said is None:
        return None
    rows = [line.split("|") for line in said.splitlines()]
    return frozenset(row[0] for row in rows if row[-1] in (*WAITING, *GOING))


def jobs_of(runs: Collection[str], folder: Path) -> list[Job]:
    """Jobs of some runs, those that ended lately included; none where no Slurm answers.

    Parameters
    ----------
    runs : collection of str
        Names of all runs of a study.
    folder : Path
        In which the commands were given: others may have runs of the same names.
    """
    here, found = str(folder.resolve()), []
    for line in (_squeue(_FIELDS) or "").splitlines():
        fields = line.split("|")
        if len(fields) != 9:
            continue
        name, comment, place = fields[6:]
        match = _COMMENT.fullmatch(comment)
        if match and match[1] in runs and name.startswith(_PREFIX) and place == here:
            number, state, reason, used, asked, nodes = fields[:6]
            found.append(Job(number, state, reason, used, asked, nodes, match[1]))
    return found


def cancel(jobs: Sequence[Job]) -> None:
    """Take jobs out of the queue."""
    if jobs:
        numbers = [job.number for job in jobs]
        subprocess.run(["scancel", *numbers], capture_output=True, timeout=_LIMIT_S, check=False)


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


def _squeue(fields: str) -> str | None:
    """What squeue says of the user's jobs; None where there is none or it fails."""
    if shutil.which("squeue") is None:
        return None
    command = ["squeue", "-h", "-t", "all", "-u", getpass.getuser(), "-o", fields]
    try:
        ran = subprocess.run(command, capture_output=True, text=True, timeout=_LIMIT_S, check=False)
    except (OSError, subprocess.TimeoutExpired):
        return None
    return ran.stdout if ran.returncode == 0 else None
