"""Fail loudly when a run of the study failed."""

from pathlib import Path

import sandmould.runs.silent_interrupt  # noqa: F401
from sandmould.execution.check import failed_runs
from sandmould.execution.job_log import to_log

with to_log(snakemake.log[0]):
    failed_runs(Path(snakemake.input.summary).parent)
