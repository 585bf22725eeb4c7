"""A study from its file to its report.

Snakemake computes the runs; where the study asks for rounds, its results choose the runs of the
next one, which are appended until there is reason to end, then those of its controls. Options
go on to Snakemake.

To start Snakemake takes longer than all else of a command that has nothing to compute. So what it
looks at is noted when it has ended well, and it is asked again once any of that has changed.
"""

from __future__ import annotations

import contextlib
import os
import re
import sys
import time
from collections.abc import Iterator, Sequence
from functools import partial
from pathlib import Path

import sandmould.runs.one_blas_thread  # noqa: F401
from sandmould import SHIPPED
from sandmould.bad_input import BAD_INPUT_EXIT
from sandmould.definition.run import LAST_MEASURED
from sandmould.digest import digest
from sandmould.execution.cluster.driver import replace_driver
from sandmould.execution.cluster.queue import end_jobs, jobs_of
from sandmould.execution.cluster.settings import goes_to_slurm, may_be_elsewhere
from sandmould.execution.locks import let_go
from sandmould.execution.screen.ending import last_line, trouble
from sandmould.execution.screen.screen import Screen
from sandmould.execution.stopping import Stopped, run_in_group, until_stopped
from sandmould.plain_file import UNREADABLE, read_plain
from sandmould.runs.claim import CLAIM_FILE
from sandmould.runs.files import write_text
from sandmould.runs.manifest import MANIFEST_FILE, OUTCOME_FILE
from sandmould.runs.products import SPENT_FILE, note_spent
from sandmould.study.plan.announcement import write_files
from sandmould.study.plan.build_plan import RESULTS, Plan, checked_plan, starts_jobs, writing
from sandmould.study.plan.grain_check import coarser_text
from sandmould.study.plan.plan_files import SUMMARY
from sandmould.study.robustness.controls import COARSER

_SETTLED_FILE = "settled.txt"
_NOT_LOOKED_AT = ("logs", "lock", CLAIM_FILE, SPENT_FILE, _SETTLED_FILE)
_OF_RUN = ("deck.in", OUTCOME_FILE, MANIFEST_FILE, "series.tsv", LAST_MEASURED)


def run_study(path: Path, options: Sequence[str], opening: str = "") -> int:
    """Compute a study, all its rounds and its robustness checks.

    ``options``: of Snakemake, such as ``--cores 4`` or ``--workflow-profile profiles/slurm``;
    ``opening``: what the last line begins with where all went well.

    Gives the exit status of the last call of Snakemake: not 0 where a run failed, or that of a
    shell after Ctrl-C or kill.

    Raises
    ------
    BadInputError
        Before anything starts.
    """
    return until_stopped(partial(_run_study, path, options, opening), path.stem)


def _run_study(path: Path, options: Sequence[str], opening: str) -> int:
    plan = checked_plan(path)
    try:
        return _compute(plan, options, opening)
    finally:
        note_spent(RESULTS / plan.study.name, time.process_time())


def _compute(plan: Plan, options: Sequence[str], opening: str) -> int:
    path = plan.study.path
    if starts_jobs(options):
        replace_driver(plan.study.name)
    folder, study = RESULTS / plan.study.name, plan.study.study
    is_whole_study = not options or (options[0] == "--cores" and len(options) == 2)
    if is_whole_study and is_settled(plan, RESULTS):
        runs = len(plan.runs)
        print(f"{plan.study.name}: {runs} of {runs} runs done, nothing left", file=sys.stderr)
        print(f"{opening} {last_line(folder)}".strip())
        return 0
    begun_s = time.monotonic()
    while starts_jobs(options) and _may_follow(plan):
        if _snakemake(plan, options, [str(folder / SUMMARY)], begun_s):
            # Stopped, or broken outside the runs: a run that fails leaves its outcome.
            return 1
        from sandmould.study.next_round import decide_next  # statistics: slow to import

        log, decision = decide_next(study, folder)
        plan = checked_plan(path)
        more = study.refine.rounds or study.certificate.controls
        told = " ".join(filter(None, (decision if more else "", coarser_text(plan.runs))))
        if told:
            print(f"\n{told}", file=sys.stderr, flush=True)
        if log.ended:
            break
    status = _snakemake(plan, options, [], begun_s)
    if starts_jobs(options) and (said := last_line(folder)):
        print(said if status else f"{opening} {said}".strip())
    if is_whole_study and not status:
        note_settled(plan, RESULTS)
    return status


def _may_follow(plan: Plan) -> bool:
    """Whether runs may follow that only those of the sweep tell."""
    study = plan.study.study
    coarser = any(run.part == COARSER.part for run in (*plan.later, *plan.runs))
    return bool(study.refine.rounds or study.certificate.controls) or coarser


def _snakemake(plan: Plan, options: Sequence[str], targets: Sequence[str], begun_s: float) -> int:
    """Have Snakemake compute a study that is shown meanwhile; its start was at ``begun_s``."""
    stated = stated_cores(options)
    cores = [] if stated is not None else ["--cores", str(_all_cores())]
    file = str(plan.study.path.absolute())
    workflow = ["--snakefile", str(SHIPPED / "Snakefile"), "--configfile", file]
    arguments = [*cores, *workflow, *options]
    arguments += ["--", *targets] if targets else []
    folder = RESULTS / plan.study.name
    work = partial(_be_snakemake, arguments, folder)
    if not starts_jobs(options):
        return run_in_group(work)
    with writing(folder):
        submits = goes_to_slurm(options)
        screen = Screen(plan, RESULTS, stated or _all_cores(), submits=submits, begun_s=begun_s)
        log = screen.log.open("w", encoding="utf-8")
    with log:
        names = [run.run for run in (*plan.fills, *plan.runs)]
        earlier = jobs_of(names) if submits else []
        with screen:
            # Snakemake would cancel its jobs, too, but take half a minute.
            asked_first = may_be_elsewhere(options) and not submits
            try:
                status = run_in_group(work, log, screen.environment(), screen.look, asked_first)
            except Stopped as end:
                if submits:
                    end.said = end_jobs(jobs_of(names), earlier)
                raise
        if status == BAD_INPUT_EXIT:
            return status
        screen.tell_failures()
        if status and not screen.is_explained and (said := trouble(folder, screen.log)):
            print(said, file=sys.stderr)
    return status


def _be_snakemake(arguments: Sequence[str], folder: Path) -> None:
    """Do what ``python -m snakemake`` does, in this process, which has the plan."""
    from snakemake.cli import main

    sys.argv = ["snakemake", *arguments]
    try:
        main()
    finally:
        note_spent(folder, time.process_time())
        let_go()


def stated_cores(options: Sequence[str]) -> int | None:
    """Cores, or jobs at a time, as the options of Snakemake state them; None where none does.

    All cores of this machine for words such as ``all``.
    """
    for place, option in enumerate(options):
        if found := _CORES.match(option):
            value = found["value"] or next(iter(options[place + 1 :]), "")
            return int(value) if value.isdecimal() else _all_cores()
    return None


_CORES = re.compile(r"(?:--cores|--jobs|-c|-j)(?:=?(?P<value>\w+))?$")


def _all_cores() -> int:
    return os.cpu_count() or 1


def is_settled(plan: Plan, results: Path) -> bool:
    """Whether no run lacks anything, and all files are those of the last start that ended well.

    The plan is written to disk where that may be so.
    """
    try:
        noted = read_plain(results / plan.study.name / _SETTLED_FILE)
    except UNREADABLE:
        return False
    if plan.lacks(results):
        return False
    write_files(plan, results)
    return noted == _state(plan, results)


def note_settled(plan: Plan, results: Path) -> None:
    """Note that nothing is left to do."""
    with contextlib.suppress(OSError):  # without it Snakemake is asked once more
        write_text(results / plan.study.name / _SETTLED_FILE, _state(plan, results))


def _state(plan: Plan, results: Path) -> str:
    """Hash of names, sizes and times of all that Snakemake looks at."""
    states = []
    for path in _looked_at(plan, results):
        if path.exists():
            stat = path.stat()
            states.append(f"{path} {stat.st_size} {stat.st_mtime_ns}\n")
    return digest(*states)


def _looked_at(plan: Plan, results: Path) -> Iterator[Path]:
    folder = results / plan.study.name
    yield from (path for path in sorted(folder.iterdir()) if path.name not in _NOT_LOOKED_AT)
    yield from sorted((folder / "batches").glob("*"))
    yield from (folder / run.place / name for run in plan.runs for name in _OF_RUN)
    yield from (results / name / SUMMARY for name in plan.study.study.calibration.also)
    for rules in ("Snakefile", "workflow/rules/*", "templates/report/*"):
        yield from sorted(SHIPPED.glob(rules))
