"""Compute one run in a process of its own."""

import sandmould.runs.silent_interrupt  # noqa: F401
from sandmould.execution.standby import do_job

do_job(
    "simulate_run",
    snakemake.input.scenario,
    snakemake.log[0],
    snakemake.resources.tasks,
    snakemake.resources.mpi,
)
