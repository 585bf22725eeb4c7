"""What a run costs beside its engine's loop, part by part, in seconds of a core."""

from __future__ import annotations

import shutil
from contextlib import chdir
from pathlib import Path
from statistics import median

from benchmarks.scaling.measure import cpu_s
from benchmarks.scaling.study import Place
from sandmould.execution.simulate import measure_run, render_run
from sandmould.study.plan.build_plan import open_plan

REPEATS = 5
IMPORTED = {
    "preamble of a script": "snakemake.script",
    "imports of a run": "sandmould.execution.simulate",
    "imports of measuring": "sandmould.kinds.sand.measure",
    "imports of a shared job": "sandmould.execution.jobs",
}


def parts(place: Place, runs: int) -> dict[str, float]:
    """Processor time of each part, median of a few.

    Parameters
    ----------
    place : Place
    runs : int
        Of a finished study, whose first run is taken.
    """
    run = min((place.results(runs) / "runs").iterdir())
    copy = place.folder / "one_run"
    start_s = _median([place.python("-c", "pass").cpu_s for _ in range(REPEATS)])
    cpu_s_of = {"start of Python": start_s}
    for name, module in IMPORTED.items():
        took = [place.python("-c", f"import {module}").cpu_s for _ in range(REPEATS)]
        cpu_s_of[name] = _median(took) - start_s
    whole = []
    for _ in range(REPEATS):
        shutil.rmtree(copy, ignore_errors=True)
        shutil.copytree(run, copy)
        (copy / "outcome.json").unlink()
        whole.append(place.python("-m", "sandmould.execution.simulate", str(copy)).cpu_s)
    cpu_s_of["process of a run"] = _median(whole)
    with chdir(place.folder):
        cpu_s_of["rendering"] = _median([cpu_s(lambda: render_run(copy)) for _ in range(REPEATS)])
        cpu_s_of["measuring"] = _median([cpu_s(lambda: measure_run(copy)) for _ in range(REPEATS)])
    shutil.rmtree(copy)
    return cpu_s_of


def _median(values: list[float]) -> float:
    return float(median(values))


def job_start(place: Place, study: Path) -> float:
    """Processor time until a Snakemake that is started for one job knows what to do.

    A job of a cluster starts two of them, one in the allocation and one in its step.
    """
    with chdir(place.folder):
        first = open_plan(study).runs[0].run
    target = f"results/{study.stem}/batches/{first}.done"
    return place.python(
        "-m", "snakemake", "--configfile", study.name, "--config", "batch_wall_s=300",
        "--mode", "remote", "--cores", "1", "--dry-run", "--quiet", "all", "--", target,
    ).cpu_s  # fmt: skip
