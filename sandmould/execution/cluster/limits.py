"""What a cluster allows: asked of Slurm before any job is submitted."""

from __future__ import annotations

import math
import re
import subprocess
from collections.abc import Iterable, Sequence
from typing import NamedTuple

from sandmould.bad_input import BadInputError, Problem
from sandmould.execution.cluster.settings import CLUSTER_FILE, Cluster

_LIMIT_S = 60.0
_TRIED = 3


class Demand(NamedTuple):
    """What a job asks for."""

    ranks: int
    cores_a_rank: int
    memory_mb: int

    def options(self, wall_min: float) -> list[str]:
        """The same for ``sbatch``, with a wall time that may be infinite."""
        minutes = max(1, int(wall_min)) if math.isfinite(wall_min) else 0
        cores = [f"--ntasks={self.ranks}", f"--cpus-per-task={self.cores_a_rank}"]
        return [f"--time={minutes}", *cores, f"--mem={self.memory_mb}"]


class JobLimits(NamedTuple):
    """What every job of a start is allowed."""

    longest_min: float = math.inf
    """Wall time that it may ask for."""
    why: str = ""
    """What sets that."""
    cores: float = math.inf
    """Of the smallest node that it may be sent to."""


def limits(cluster: Cluster) -> JobLimits:
    """What the partitions that jobs are sent to allow.

    Raises
    ------
    BadInputError
        Where Slurm does not answer, or a partition is none of its.
    """
    said = [line.split() for line in answer(["sinfo", "-h", "-o", "%P %l %c"]).splitlines()]
    rows = [row for row in said if len(row) == 3]  # several a partition whose nodes differ
    there = list(dict.fromkeys(row[0].rstrip("*") for row in rows))
    default = {row[0][:-1] for row in rows if row[0].endswith("*")}
    names = set(cluster.partition.split(",")) if cluster.partition else default
    for name in sorted(names.difference(there)):
        valid = f"a partition of this cluster: {', '.join(there)}"
        raise BadInputError([Problem("partition", name, valid, str(CLUSTER_FILE))])
    used = [(p.rstrip("*"), limit, cores) for p, limit, cores in rows if p.rstrip("*") in names]
    allowed = [(minutes(limit), f"the limit of partition {name}") for name, limit, _ in used]
    if cluster.longest_wall_h is not None:
        allowed.append((60 * cluster.longest_wall_h, f"longest_wall_h of {CLUSTER_FILE}"))
    # "16+" where nodes have 16 and more
    cores = min((int(cores.rstrip("+")) for *_, cores in used), default=math.inf)
    return JobLimits(*min(allowed, default=(math.inf, "")), cores)


def minutes(text: str) -> float:
    """Minutes of a wall time as Slurm writes it, such as ``1-00:00:00``; infinite without end."""
    match = re.fullmatch(r"(?:(\d+)-)?(?:(\d+):)?(\d+):(\d+)", text)
    if match is None:
        return math.inf
    days, hours, rest, seconds = (int(part or 0) for part in match.groups())
    return 1440 * days + 60 * hours + rest + seconds / 60


def check_jobs(cluster: Cluster, wall_min: int, demands: Iterable[Demand]) -> None:
    """Let Slurm judge the largest jobs, without submitting one.

    Raises
    ------
    BadInputError
        With what it says, once.
    """
    different = sorted(set(demands))
    largest = {max(different, key=lambda d: d.memory_mb), max(different)} if different else set()
    for demand in sorted(largest)[:_TRIED]:
        asked = [*cluster.sbatch(), *demand.options(wall_min)]
        cores = f"{demand.ranks * demand.cores_a_rank} cores, as batch_cores of the profile allows"
        said_of = f"a job of {cores}, {demand.memory_mb} MB"
        answer(["sbatch", "--test-only", *asked, "--wrap=true"], said_of)


def answer(command: Sequence[str], asked: str = "") -> str:
    """What a program of Slurm says; its refusal of what is asked becomes one sentence.

    Raises
    ------
    BadInputError
    """
    try:
        ran = subprocess.run(command, capture_output=True, text=True, timeout=_LIMIT_S, check=False)
    except (OSError, subprocess.TimeoutExpired) as error:
        valid = f"a machine from which Slurm answers, since {command[0]} does not ({error})"
        raise BadInputError([Problem("--cluster", "Slurm", valid)]) from None
    if ran.returncode == 0:
        return ran.stdout
    lines = [line.split("error: ")[-1].strip() for line in ran.stderr.splitlines()]
    said = next((line for line in lines if line), f"exit status {ran.returncode}")
    stated = " ".join([option for option in command[2:] if option.startswith("--")][:-1])
    valid = f"what this cluster takes: {command[0]} says {said!r}"
    if asked:
        valid += f" of {asked} ({stated})"
    raise BadInputError([Problem(str(CLUSTER_FILE), "as it is", valid)])
