"""Fail loudly when a run of the study failed."""

from pathlib import Path

from sandmould.study.check import failed_runs
from sandmould.study.job_log import to_log

with to_log(snakemake.log[0]):
    failed_runs(Path(snakemake.input.summary).parent)
