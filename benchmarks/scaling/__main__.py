"""How the workflow bears thousands of runs.

``make scaling`` runs ``python -m benchmarks.scaling``, which writes
docs/developers/workflow_cost.md with its
picture. It takes 46 minutes of two cores that have nothing else to do; the same command goes on
from where it was stopped.
"""

from __future__ import annotations

import json
import os
from collections.abc import Mapping
from functools import partial
from pathlib import Path
from typing import Any, NamedTuple

from benchmarks.frame import SCRATCH, Benchmark, BenchmarkRun
from benchmarks.scaling.chart import draw
from benchmarks.scaling.measure import appended, executed, files, finished, grafted, graphs, planned
from benchmarks.scaling.page import page
from benchmarks.scaling.peers import peers
from benchmarks.scaling.run_parts import job_start, parts
from benchmarks.scaling.study import Place

BEFORE_JSON = Path(__file__).with_name("before.json")
ALONE_UP_TO = 100
"""Runs up to which three jobs a run are executed too."""
CORES = 2


class StudySizes(NamedTuple):
    """Numbers of runs."""

    executed: tuple[int, ...]
    linked: tuple[int, ...]
    """Of studies that are planned, collected and reported but not computed."""
    peers: int
    """Of the comparison with other tools."""


def rows(run: BenchmarkRun) -> dict[str, Any]:
    """Measure studies of all sizes."""
    place = Place(SCRATCH / "scaling")
    sizes: StudySizes = run.extent
    if not run.parts.path(f"{sizes.executed[0]} runs").exists():
        place.empty()
    # The machine is calibrated and kernels are compiled once, before anything counts.
    place.snakemake(place.study(1), "--cores", "1", shared=False)
    measured = {
        str(n): run.parts.get(f"{n} runs", partial(_executed, place, n)) for n in sizes.executed
    }
    for n in sizes.linked:
        measure = partial(_linked, place, n, sizes.executed[-1])
        measured[str(n)] = run.parts.get(f"{n} runs, with products of others", measure)
    return measured


def _executed(place: Place, runs: int) -> dict[str, Any]:
    """All of a study whose runs are computed."""
    study = place.study(runs)
    row = {**planned(place, study), **graphs(place, study), "job_start": job_start(place, study)}
    if runs <= ALONE_UP_TO:
        row["run_alone"] = executed(place, runs, study, False, CORES)
    row["run_shared"] = executed(place, runs, study, True, CORES)
    row |= {"files": files(place, runs), **finished(place, runs, study)}
    return row | appended(place, runs)


def _linked(place: Place, runs: int, source: int) -> dict[str, Any]:
    """All of a study whose runs have the products of another's."""
    row = grafted(place, runs, source)
    study = place.study(runs)
    row["job_start"] = job_start(place, study)
    return row | finished(place, runs, study) | appended(place, runs)


def rounded(tree: Any) -> Any:
    """A tree with its times to a tenth of a millisecond."""
    if isinstance(tree, Mapping):
        return {key: rounded(value) for key, value in tree.items()}
    return round(tree, 4) if isinstance(tree, float) else tree


def arrange(measured: dict[str, Any], run: BenchmarkRun) -> dict[str, Any]:
    """Results beside those of before, with where and how long they were measured."""
    results: dict[str, Any] = rounded({
        "before": json.loads(BEFORE_JSON.read_text(encoding="utf-8")), **measured,
        "took_s": round(run.took_s), "load_before": run.load_before,
        "load_after": os.getloadavg()[0], "provenance": run.origin,
    })  # fmt: skip
    return results


BENCHMARK = Benchmark(
    __file__,
    __doc__,
    parts={
        "rows": rows,
        "parts": lambda run: parts(Place(SCRATCH / "scaling"), run.extent.executed[0]),
        "peers": lambda run: peers(SCRATCH / "peers", run.extent.peers, CORES),
    },
    pages={"developers/workflow_cost.md": page},
    draw=lambda results, folder: draw(results, folder / "developers" / "workflow_cost.png"),
    extent=StudySizes((10, 100, 1_000), (10_000,), 100),
    quick=StudySizes((3, 10), (30,), 10),
    arrange=arrange,
)

if __name__ == "__main__":
    BENCHMARK.command()
