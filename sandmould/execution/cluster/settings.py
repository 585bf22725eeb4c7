"""What a user says of a cluster, in ``cluster.yaml`` of the working folder, and what it allows."""

from __future__ import annotations

import itertools
import math
import os
import re
import subprocess
from collections.abc import Iterable, Sequence
from pathlib import Path
from typing import NamedTuple

from pydantic import Field

from sandmould.bad_input import BadInputError, Problem
from sandmould.scenario.quantity import Section
from sandmould.scenario.reading import Origin, read_yaml, validated

CLUSTER_FILE = Path("cluster.yaml")
WORD = r"^[A-Za-z0-9_.,:@&|+*=\[\]()-]+$"
"""Nothing that a shell takes for more than a word."""
RESOURCES = {
    "partition": "slurm_partition",
    "account": "slurm_account",
    "qos": "qos",
    "constraint": "constraint",
}
"""What a job is submitted with: option of ``sbatch`` and key here, and resource of Snakemake."""
LIMIT_S = 60.0
"""For a program of Slurm to answer."""
_TRIED = 3
_CHOOSES = ("--workflow-profile", "--profile", "--executor", "-e")


class Cluster(Section):
    """A queue of a cluster, and how long its jobs may take."""

    partition: str | None = Field(
        None,
        pattern=WORD,
        description="Partition, or several with commas; Slurm's own unless given.",
    )
    account: str | None = Field(None, pattern=WORD, description="Who pays.")
    qos: str | None = Field(None, pattern=WORD, description="Quality of service.")
    constraint: str | None = Field(None, pattern=WORD, description="Kind of node.")
    options: str | None = Field(
        None,
        pattern=r"^-[A-Za-z0-9_.,:@&|+*=\[\]()/ -]+$",
        description="Other options of sbatch, such as --mail-type=END.",
    )
    longest_wall_h: float | None = Field(
        None,
        gt=0,
        description="Most wall time that a job asks for; a longer run goes on in the next.",
    )

    def resources(self) -> dict[str, str]:
        """What Snakemake submits each job with."""
        stated = {resource: getattr(self, name) for name, resource in RESOURCES.items()}
        return {resource: value for resource, value in stated.items() if value is not None}

    def sbatch(self) -> list[str]:
        """The same as options of ``sbatch``."""
        values = {name: getattr(self, name) for name in RESOURCES}
        stated = [f"--{name}={value}" for name, value in values.items() if value is not None]
        return [*stated, *(self.options or "").split()]


def read_cluster(path: Path = CLUSTER_FILE) -> Cluster:
    """Read what the user says; nothing is said where the file is not there.

    Raises
    ------
    BadInputError
    """
    if not path.exists():
        return Cluster()
    return validated(Cluster, read_yaml(path, str(path)), Origin({"": str(path)}))


def may_be_elsewhere(arguments: Sequence[str]) -> bool:
    """Whether Snakemake called with these arguments may send jobs to other machines.

    A profile can come from the environment, too.
    """
    named = any(argument.split("=")[0] in _CHOOSES for argument in arguments)
    return named or "SNAKEMAKE_PROFILE" in os.environ


def goes_to_slurm(arguments: Sequence[str]) -> bool:
    """Whether Snakemake called with these arguments submits jobs to Slurm, as its profile says."""
    words = [
        word for argument in arguments for word in re.split("(?<=[a-z])=", argument, maxsplit=1)
    ]
    return any(
        option in _CHOOSES and "slurm" in Path(value).name
        for option, value in itertools.pairwise(words)
    )


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
        ran = subprocess.run(command, capture_output=True, text=True, timeout=LIMIT_S, check=False)
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
