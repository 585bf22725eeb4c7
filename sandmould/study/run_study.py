"""A study from its file to its report: ``python -m sandmould.study.run_study STUDY.yaml``.

Snakemake computes the runs; where the study asks for rounds, its results choose the runs of the
next one, which are appended until there is reason to end, then those of its controls. Options
go on to Snakemake.
"""

from __future__ import annotations

import os
import subprocess
import sys
from collections.abc import Sequence
from pathlib import Path

from sandmould.scenario.bad_input import BadInputError
from sandmould.statistics.agreement import sweep_part
from sandmould.study.build_plan import RESULTS, open_plan
from sandmould.study.collect import read_summary, swept_keys
from sandmould.study.rounds.decide import decision_text, next_runs
from sandmould.study.rounds.round_log import read_rounds, write_rounds


def drive(path: Path, options: Sequence[str]) -> int:
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
        Exit status of the last call of Snakemake: not 0 where a run failed.

    Raises
    ------
    BadInputError
        Before anything starts.
    """
    plan = open_plan(path)
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
    command = [sys.executable, "-m", "snakemake", *cores, "--configfile", str(path), *options]
    return subprocess.run([*command, *(["--", *targets] if targets else [])]).returncode


def _all_cores() -> list[str]:
    return ["--cores", str(os.cpu_count() or 1)]


def main(arguments: Sequence[str]) -> int:
    """Say what is wrong with a study, or drive it."""
    if not arguments:
        print("which study? such as config/studies/tube_demo.yaml", file=sys.stderr)
        return 2
    try:
        return drive(Path(arguments[0]), arguments[1:])
    except BadInputError as error:
        print(error, file=sys.stderr)
        return 1


if __name__ == "__main__":
    raise SystemExit(main(sys.argv[1:]))
