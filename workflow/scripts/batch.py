"""Compute and measure several runs in one job."""

import sandmould.runs.silent_interrupt  # noqa: F401
from sandmould.execution.standby import do_job

do_job(
    "compute_batch",
    list(snakemake.input.scenarios),
    snakemake.log[0],
    snakemake.resources.tasks,
    snakemake.resources.mpi,
    snakemake.params.side_by_side,
)
