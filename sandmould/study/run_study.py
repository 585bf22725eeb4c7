"""A study from its file to its report.

Snakemake computes the runs; where the study asks for rounds, its results choose the runs of the
next one, which are appended until there is reason to end, then those of its controls. Options
go on to Snakemake.
"""

from __future__ import annotations

import os
import sys
from collections.abc import Sequence
from functools import partial
from pathlib import Path

from sandmould import ROOT
from sandmould.statistics.agreement import sweep_part
from sandmould.study.collect import read_summary, swept_keys
from sandmould.study.plan.build_plan import RESULTS, open_plan
from sandmould.study.plan.trust import check_letters, check_places, check_trust
from sandmould.study.rounds.decide import decision_text, next_runs
from sandmould.study.rounds.round_log import read_rounds, write_rounds
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
    report = folder / "report.html"
    if report.exists():
        print(f"The report: {report}")
    return status


def _snakemake(path: Path, options: Sequence[str], targets: Sequence[str]) -> int:
    cores = [] if any(o in ("--cores", "-c", "--jobs", "-j") for o in options) else _all_cores()
    workflow = ["--snakefile", str(ROOT / "Snakefile"), "--configfile", str(path.absolute())]
    command = [sys.executable, "-m", "snakemake", *cores, *workflow, *options]
    return run_snakemake([*command, *(["--", *targets] if targets else [])])


def _all_cores() -> list[str]:
    return ["--cores", str(os.cpu_count() or 1)]
