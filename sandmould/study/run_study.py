"""A study from its file to its report.

Snakemake computes the runs; where the study asks for rounds, its results choose the runs of the
next one, which are appended until there is reason to end, then those of its controls. Options
go on to Snakemake.
"""

from __future__ import annotations

import os
import re
import sys
from collections.abc import Sequence
from functools import partial
from pathlib import Path

from sandmould import ROOT
from sandmould.scenario.bad_input import BAD_INPUT_EXIT
from sandmould.statistics.agreement import sweep_part
from sandmould.study.collect import read_summary, swept_keys
from sandmould.study.plan.build_plan import RESULTS, open_plan, starts_jobs, writing
from sandmould.study.plan.trust import check_letters, check_places, check_trust
from sandmould.study.rounds.decide import decision_text, next_runs
from sandmould.study.rounds.round_log import read_rounds, write_rounds
from sandmould.study.screen.ending import last_line, trouble
from sandmould.study.screen.screen import Screen
from sandmould.study.stopping import run_snakemake, until_stopped


def run_study(path: Path, options: Sequence[str]) -> int:
    """Compute a study, all its rounds and its robustness checks.

    Parameters
    ----------
    path : Path
        The study's file.
    options : sequence of str
        Of Snakemake, such as ``--cores 4`` or ``--workflow-profile profiles/slurm``.

    Returns
    -------
    int
        Exit status of the last call of Snakemake: not 0 where a run failed, or that of a shell
        after Ctrl-C or kill.

    Raises
    ------
    BadInputError
        Before anything starts.
    """
    return until_stopped(partial(_run_study, path, options), path.stem)


def _run_study(path: Path, options: Sequence[str]) -> int:
    plan = open_plan(path)
    check_places(plan.study)
    check_letters(plan.runs)
    check_trust(plan.study, plan.runs)
    folder, study = RESULTS / plan.study.name, plan.study.study
    while study.refine.rounds or study.certificate.controls:
        if _snakemake(path, options, [str(folder / "summary.tsv")]):
            # Stopped, or broken outside the runs: a run that fails by itself leaves its outcome.
            return 1
        summary = sweep_part(read_summary(folder))
        log = next_runs(read_rounds(folder, study), study, summary, list(swept_keys(summary)))
        write_rounds(log, folder)
        print(f"\n{decision_text(log, study)}", file=sys.stderr, flush=True)
        if log.ended:
            break
    status = _snakemake(path, options, [])
    if starts_jobs(options) and (said := last_line(folder)):
        print(said)
    return status


def _snakemake(path: Path, options: Sequence[str], targets: Sequence[str]) -> int:
    """Call Snakemake with a study that is shown while it is computed."""
    stated = stated_cores(options)
    cores = [] if stated is not None else ["--cores", str(_all_cores())]
    workflow = ["--snakefile", str(ROOT / "Snakefile"), "--configfile", str(path.absolute())]
    command = [sys.executable, "-m", "snakemake", *cores, *workflow, *options]
    command += ["--", *targets] if targets else []
    if not starts_jobs(options):
        return run_snakemake(command)
    plan = open_plan(path)
    with writing(RESULTS / plan.study.name):
        screen = Screen(plan, RESULTS, stated or _all_cores())
        log = screen.log.open("w", encoding="utf-8")
    with log:
        with screen:
            status = run_snakemake(command, log, screen.environment(), screen.look)
        if status == BAD_INPUT_EXIT:
            return status
        screen.tell_failures()
        if status and not screen.is_explained and (found := trouble(screen.log)):
            for line in (*found, f"All that Snakemake said: {screen.log}"):
                print(line, file=sys.stderr)
    return status


def stated_cores(options: Sequence[str]) -> int | None:
    """Cores, or jobs at a time, as the options of Snakemake state them; None where none does.

    Parameters
    ----------
    options : sequence of str

    Returns
    -------
    int or None
        All cores of this machine for words such as ``all``.
    """
    for place, option in enumerate(options):
        found = _CORES.match(option)
        if found:
            value = found["value"] or next(iter(options[place + 1 :]), "")
            return int(value) if value.isdecimal() else _all_cores()
    return None


_CORES = re.compile(r"(?:--cores|--jobs|-c|-j)(?:=?(?P<value>\w+))?$")


def _all_cores() -> int:
    return os.cpu_count() or 1
