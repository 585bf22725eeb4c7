"""Compute and measure several runs in one job."""

from pathlib import Path

import sandmould.runs.one_blas_thread
import sandmould.runs.silent_interrupt  # noqa: F401
from sandmould.study.batch_job import compute_batch

compute_batch(
    [Path(scenario).parent for scenario in snakemake.input.scenarios],
    Path(snakemake.log[0]),
    snakemake.resources.tasks,
    snakemake.resources.mpi,
    snakemake.params.side_by_side,
)
