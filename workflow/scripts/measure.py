"""Measure one run."""

from pathlib import Path

import sandmould.runs.silent_interrupt  # noqa: F401
from sandmould.study.job_log import to_log
from sandmould.study.simulate import measure_run

with to_log(snakemake.log[0]):
    measure_run(Path(snakemake.input.scenario).parent)
