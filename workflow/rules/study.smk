# The study is validated and expanded before Snakemake builds its graph: bad input ends here, in
# one sentence a problem.
import os
import sys

from sandmould.scenario.bad_input import BadInputError
from sandmould.study.planning import RESULTS, announce, open_plan, study_path

try:
    PLAN = open_plan(study_path(workflow.configfiles, workflow.config_settings.config))
    if workflow.is_main_process and "--lint" not in sys.argv:
        print(
            announce(PLAN, RESULTS, workflow._cores or os.cpu_count()),
            file=sys.stderr,
        )
except BadInputError as error:
    sys.exit(str(error))

STUDY = PLAN.study
FOLDER = f"results/{STUDY.name}"
# Studies whose runs help to calibrate: they are finished before this one is.
ALSO = [f"results/{name}/summary.tsv" for name in STUDY.study.calibration.also]
RUNS = [run.run for run in PLAN.runs]
REPORT_TEMPLATES = sorted(str(p) for p in Path("templates/report").iterdir())


def deck_sources_of(wildcards):
    return PLAN.deck_sources(wildcards.run)


def threads_of(wildcards):
    return PLAN.threads(wildcards.run)


def ranks_of(wildcards):
    return PLAN.ranks(wildcards.run)


def memory_mb_of(wildcards):
    return PLAN.memory_mb(wildcards.run)


def runtime_min_of(wildcards, attempt):
    return attempt * PLAN.runtime_min(wildcards.run)


def labels_of(wildcards):
    return PLAN.labels(wildcards.run)


wildcard_constraints:
    run="|".join(RUNS),
