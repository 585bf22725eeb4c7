"""Compute one run in a process of its own."""

from pathlib import Path

from sandmould.study.process import launch

launch(
    Path(snakemake.input.scenario).parent,
    Path(snakemake.log[0]),
    snakemake.resources.tasks,
    snakemake.resources.mpi,
)
