"""Measure the snapshots of one run."""

from pathlib import Path

from sandmould.study.job_log import to_log
from sandmould.study.measure import write_exports, write_measures, write_picture, write_profile

with to_log(snakemake.log[0]):
    folder = Path(snakemake.input.scenario).parent
    write_measures(folder, Path(snakemake.output.measures))
    write_exports(folder, Path(snakemake.output.exports))
    write_profile(folder, Path(snakemake.output.profile))
    write_picture(folder, Path(snakemake.output.picture))
