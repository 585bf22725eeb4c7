"""What a user says of a cluster: ``cluster.yaml`` in the working folder, which no study holds."""

from __future__ import annotations

import itertools
import os
import re
from collections.abc import Sequence
from pathlib import Path

from pydantic import Field

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
