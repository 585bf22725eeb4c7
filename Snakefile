from pathlib import Path

from snakemake.utils import min_version

min_version("9.20")


report: "workflow/report/workflow.rst"


include: "workflow/rules/study.smk"
include: "workflow/rules/run.smk"
include: "workflow/rules/results.smk"


localrules:
    all,


rule all:
    default_target: True
    input:
        rules.report.output.html,
        rules.check.output.done,
        [rules.calibrate.output.done] if STUDY.study.calibration.sands else [],
    message:
        f"The report of the study {STUDY.name} is {rules.report.output.html}"
