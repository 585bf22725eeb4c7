from pathlib import Path

from snakemake.utils import min_version

min_version("9.20")


report: "workflow/report/workflow.rst"


include: "workflow/rules/study.smk"
include: "workflow/rules/run.smk"
include: "workflow/rules/results.smk"


# What takes seconds is no job for a cluster's queue.
localrules:
    all,
    collect,
    calibrate,
    report,
    check,


onstart:
    # The limit on jobs a second makes Snakemake look over all jobs again a second after each that
    # ended, and again a second after that, without end: 150 runs into a study half a core was
    # busy with it. Jobs on this machine need no such limit.
    if workflow.local_exec:
        workflow.scheduler.job_rate_limiter = None


onerror:
    # After Ctrl-C too; "sandmould run" says it by itself.
    left = PLAN.lacks(RESULTS).keys() & {run.run for run in PLAN.runs}
    if workflow.is_main_process and left:
        runs = f"{len(left)} of {len(PLAN.runs)} runs are left"
        say(f"{runs}: the same command goes on with them.")


rule all:
    default_target: True
    input:
        # All of them: a missing table is written again, too.
        rules.collect.output,
        rules.report.output,
        rules.check.output.done,
        [rules.calibrate.output.done] if STUDY.study.calibration.sands else [],
    message:
        f"The report of the study {STUDY.name} is {rules.report.output.html}"
