"""Collect all runs of a study into two tables."""

from pathlib import Path

import sandmould.runs.silent_interrupt  # noqa: F401
from sandmould.execution.job_log import to_log
from sandmould.study.collect import collect

with to_log(snakemake.log[0]):
    collect(Path(snakemake.input.table).parent)
