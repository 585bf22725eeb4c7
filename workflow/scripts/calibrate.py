"""Write the material files of a study's calibrated sands."""

from pathlib import Path

import sandmould.runs.silent_interrupt  # noqa: F401
from sandmould.execution.job_log import to_log
from sandmould.study.calibration.run import write_calibration
from sandmould.study.plan.load_study import CALIBRATED

with to_log(snakemake.log[0]):
    problems = write_calibration(Path(snakemake.input.table).parent, CALIBRATED)
    if problems:
        raise SystemExit("\n".join(problems))
