"""Core time of a short run as a forked worker computes it: ``python one_run.py STUDY.yaml``.

All runs of the study are rendered, computed and measured in one process, so that neither
Snakemake's start nor that of Python counts. It is run by its path, in the sources of any version.
"""

from __future__ import annotations

import json
import time
from pathlib import Path

from sandmould.execution.jobs import compute_batch, load_for
from sandmould.execution.simulate import measure_run, render_run, simulate
from sandmould.module_main import run_main
from sandmould.study.plan.announcement import announce, prepare
from sandmould.study.plan.build_plan import RESULTS, open_plan
from sandmould.study.plan.lacking import lack_of
from sandmould.study.plan.plan_files import read_run, write_run

WARM_UP = 2
"""Runs that come first and do not count: they load what all others find loaded."""


def main(study: str) -> None:
    """Print the core time of a run, s, the loop of its engine included."""
    plan = open_plan(Path(study))
    announce(plan, RESULTS, 1)
    prepare(plan, RESULTS)
    folder = RESULTS / plan.study.name
    (folder / "logs").mkdir(exist_ok=True)
    for fill in plan.fills:
        compute_batch([write_run(fill, folder)], str(folder / "logs" / "fills"), 1, "")
    load_for(plan.runs[0].scenario)
    for run in plan.runs[:WARM_UP]:
        _do(write_run(run, folder))
    begun_s = time.process_time()
    for run in plan.runs[WARM_UP:]:
        _do(write_run(run, folder))
    print(json.dumps((time.process_time() - begun_s) / len(plan.runs[WARM_UP:])))


def _do(folder: Path) -> None:
    """Do what a worker does for one run."""
    run = read_run(folder / "scenario.yaml")
    lack_of(run, folder)
    render_run(folder, run)
    (folder / "work").mkdir(exist_ok=True)
    simulate(folder, run)
    measure_run(folder, run)
    lack_of(run, folder)


if __name__ == "__main__":
    run_main(main, "python -m benchmarks.sweeps.one_run STUDY.yaml", (1,))
