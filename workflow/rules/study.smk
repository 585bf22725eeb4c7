# The study is validated and expanded before Snakemake builds its graph: bad input ends here, in
# one sentence a problem.
import atexit
import os
import sys
import time

from sandmould import SHIPPED
from sandmould.runs.columns import SWEEP
from sandmould.runs.parent import say
from sandmould.bad_input import BAD_INPUT_EXIT, BadInputError
from sandmould.execution.cluster.settings import goes_to_slurm, may_be_elsewhere
from sandmould.execution.cluster.submission import open_submission
from sandmould.execution import jobs
from sandmould.execution.locks import hold_turn
from sandmould.execution.pool import start_server
from sandmould.runs.products import note_spent
from sandmould.study.plan.batches import alone, read_batches, write_batches
from sandmould.study.plan.announcement import announce, prepare
from sandmould.study.plan.build_plan import (
    RESULTS,
    plan_at_hand,
    starts_jobs,
    study_path,
)
from sandmould.study.plan.plan_files import CHECKS as CHECK_TABLES
from sandmould.study.plan.plan_files import write_run
from sandmould.study.plan.load_study import CALIBRATED
from sandmould.study.plan.lacking import Need, notes_of
from sandmould.definition.run import FILL, RUN_NAME

OVERRIDES = dict(workflow.config_settings.config)
# Set by a profile: how long a job should last at least, where jobs cost more than short runs, how
# many runs are worth a batch, and how many cores a job of them should have; and what starts the
# ranks of a run.
BATCH_WALL_S = float(OVERRIDES.pop("batch_wall_s", 0))
BATCH_LEAST = int(OVERRIDES.pop("batch_least", 1))
BATCH_CORES = int(OVERRIDES.pop("batch_cores", 1))
MPI = OVERRIDES.pop("mpi", "mpiexec")
CORES = workflow.resource_settings.cores or os.cpu_count()
try:
    PLAN = plan_at_hand(study_path(workflow.configfiles, OVERRIDES))
    starts = workflow.is_main_process and starts_jobs(sys.argv)
    if starts:
        hold_turn(RESULTS / PLAN.study.name)
    STATED = workflow.resource_settings.default_resources or {}
    SUBMISSION = open_submission(PLAN, sys.argv, STATED)
    is_here = workflow.is_main_process and not may_be_elsewhere(sys.argv)
    submits = starts and goes_to_slurm(sys.argv)
    LACKING = PLAN.lacks(RESULTS) if workflow.is_main_process else {}
    if workflow.is_main_process:
        BATCHED = PLAN.batches(
            BATCH_WALL_S,
            BATCH_LEAST,
            SUBMISSION.cores(BATCH_CORES) if submits else BATCH_CORES,
            CORES if is_here else 0,
            LACKING if is_here else (),
        )
    else:
        # A job in a process of its own: what shares it was decided by the main one.
        place = RESULTS.absolute() / PLAN.study.name
        atexit.register(lambda: note_spent(place, time.process_time()))
        BATCHED = read_batches((*PLAN.fills, *PLAN.runs), RESULTS / PLAN.study.name)
    if submits:
        SUBMISSION.ask(BATCHED)
    if workflow.is_main_process and "--lint" not in sys.argv:
        # A dry run starts no engine, and nothing is measured for runs that are all there.
        computes = starts and any(
            lack.need is Need.COMPUTE for lack in LACKING.values()
        )
        say(announce(PLAN, RESULTS, CORES, "all" if computes else "nothing"))
        if said := prepare(PLAN, RESULTS, BATCHED, LACKING):
            say(f"{said}\n")
        if starts:
            write_batches(BATCHED, RESULTS / PLAN.study.name)
        if is_here and starts and LACKING:
            start_server(
                write_run(run, RESULTS / PLAN.study.name)
                for run in PLAN.first_of_each_class(LACKING)
            )
        for said in SUBMISSION.said:
            say(said)
except BadInputError as error:
    say(str(error))
    sys.exit(BAD_INPUT_EXIT)

STUDY = PLAN.study
FOLDER = f"results/{STUDY.name}"
# Studies whose runs help to calibrate: they are finished before this one is.
ALSO = [f"results/{name}/summary.tsv" for name in STUDY.study.calibration.also]
# Tables of the runs that check the sweep, where there are such runs.
CHECKS = [
    f"{FOLDER}/{name}"
    for name in CHECK_TABLES
    if any(run.part != SWEEP for run in PLAN.runs)
]
# What a cluster wants of every job.
SUBMITTED = SUBMISSION.resources()
RUNS = {run.run: run for run in (*PLAN.fills, *PLAN.runs)}
BATCHES = {batch.name: [run.run for run in batch.runs] for batch in BATCHED}
SIDE_BY_SIDE = {batch.name: batch.side_by_side for batch in BATCHED}
# Fills are computed for the runs that go on from them, not for the tables.
COLLECTED = [batch.name for batch in BATCHED if batch.runs[0].part != FILL]
ALONE = alone(PLAN.runs, BATCHED)
# What tells that a fill is there: its outcome, or its batch's mark.
FILL_MARKS = {
    fill.run: f"{FOLDER}/{fill.place}/outcome.json" for fill in PLAN.fills
} | {
    fill: f"{FOLDER}/batches/{name}.done"
    for name, fills in BATCHES.items()
    for fill in fills
    if fill in {fill.run for fill in PLAN.fills}
}
# As seen from here, wherever that is.
TEMPLATES = SHIPPED / "templates" / "report"
REPORT_TEMPLATES = sorted(os.path.relpath(path) for path in TEMPLATES.iterdir())


def compute_note_of(wildcards):
    return notes_of(f"{FOLDER}/runs/{wildcards.run}", Need.COMPUTE)


def measure_note_of(wildcards):
    return notes_of(f"{FOLDER}/runs/{wildcards.run}", Need.MEASURE)


def fills_of(runs):
    """Marks of the fills that some runs wait for; a run that is at its end waits for none."""
    awaited = [
        RUNS[run].fill
        for run in runs
        if notes_of(f"{FOLDER}/{RUNS[run].place}", Need.COMPUTE)
        or not os.path.exists(f"{FOLDER}/{RUNS[run].place}/outcome.json")
    ]
    return sorted({FILL_MARKS[fill] for fill in awaited if fill})


def fill_of(wildcards):
    return fills_of([wildcards.run])


def fill_note_of(wildcards):
    return notes_of(f"{FOLDER}/fills/{wildcards.fill}", Need.COMPUTE)


def batch_fills_of(wildcards):
    return fills_of(BATCHES[wildcards.batch])


def named(wildcards):
    """Name of the run or of the fill that a job computes."""
    return wildcards.get("run") or wildcards.fill


def threads_of(wildcards):
    return PLAN.threads(named(wildcards))


def ranks_of(wildcards):
    return PLAN.ranks(named(wildcards))


def cpus_per_task_of(wildcards):
    # Slurm would take threads for the cores of every rank.
    return PLAN.threads(named(wildcards)) // PLAN.ranks(named(wildcards))


def mpi_of(wildcards):
    # Slurm's jobs of one task must not be told of it.
    return MPI if PLAN.ranks(named(wildcards)) > 1 else ""


def memory_mb_of(wildcards):
    return PLAN.memory_mb(named(wildcards))


def runtime_min_of(wildcards):
    return SUBMISSION.runtime_min(PLAN.runtime_min(named(wildcards)))


def labels_of(wildcards):
    return PLAN.labels(wildcards.run)


def planned(*runs):
    """Folders of runs, made with what their jobs read of the plan."""
    return [write_run(RUNS[run], Path(FOLDER)) for run in runs]


def batch_notes_of(wildcards):
    runs = [f"{FOLDER}/{RUNS[run].place}" for run in BATCHES[wildcards.batch]]
    return [note for run in runs for note in notes_of(run, Need.COMPUTE, Need.MEASURE)]


def side_by_side_of(wildcards):
    return SIDE_BY_SIDE[wildcards.batch]


def batch_threads_of(wildcards):
    return PLAN.threads(wildcards.batch) * SIDE_BY_SIDE[wildcards.batch]


def batch_ranks_of(wildcards):
    return PLAN.ranks(wildcards.batch)


def batch_cpus_per_task_of(wildcards):
    return PLAN.threads(wildcards.batch) // PLAN.ranks(wildcards.batch)


def batch_mpi_of(wildcards):
    return MPI if PLAN.ranks(wildcards.batch) > 1 else ""


def batch_memory_mb_of(wildcards):
    most = max(PLAN.memory_mb(run) for run in BATCHES[wildcards.batch])
    return most * SIDE_BY_SIDE[wildcards.batch]


def batch_runtime_min_of(wildcards):
    beside = SIDE_BY_SIDE[wildcards.batch]
    runs = BATCHES[wildcards.batch]
    return SUBMISSION.runtime_min(PLAN.runtime_min(*runs, side_by_side=beside))


# Not the names themselves: Snakemake tries a pattern on every file of every run, and ten thousand
# alternatives took it half of all its time.
wildcard_constraints:
    run=RUN_NAME,
    fill=RUN_NAME,
    batch=RUN_NAME,
