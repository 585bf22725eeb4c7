"""Measure one run."""

import sandmould.runs.silent_interrupt  # noqa: F401
from sandmould.execution.standby import do_job

do_job("measure_run", snakemake.input.scenario, snakemake.log[0])
