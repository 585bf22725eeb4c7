"""Write the report of a study."""

from pathlib import Path

import sandmould.runs.silent_interrupt  # noqa: F401
from sandmould.execution.job_log import to_log
from sandmould.report.page import write_report

with to_log(snakemake.log[0]):
    write_report(Path(snakemake.input.summary).parent, Path(snakemake.output.html))
