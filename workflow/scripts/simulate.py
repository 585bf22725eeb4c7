"""Compute one run in a process of its own."""

from pathlib import Path

import sandmould.runs.silent_interrupt  # noqa: F401
from sandmould.study.process import launch

launch(
    Path(snakemake.input.scenario).parent,
    Path(snakemake.log[0]),
    snakemake.resources.tasks,
    snakemake.resources.mpi,
)
