"""How the workflow bears thousands of runs: ``python -m benchmarks.scaling``.

Writes scaling.json beside this file and docs/scaling.md with its picture. ``--quick`` shows with
few runs that everything works and writes to ``results/benchmarks``; ``--page`` writes the page of
scaling.json again. Takes an hour of two cores that have nothing else to do; ``--brief`` executes no
more than a hundred runs and compares with peers on forty.
"""

from __future__ import annotations

import json
import os
import sys
import time
from pathlib import Path
from typing import Any

from benchmarks.scaling_chart import draw
from benchmarks.scaling_measure import appended, executed, files, finished, grafted, graphs, planned
from benchmarks.scaling_page import page
from benchmarks.scaling_parts import job_start, parts
from benchmarks.scaling_peers import peers
from benchmarks.scaling_study import Place
from sandmould import ROOT
from sandmould.study.planning import open_plan
from sandmould.study.simulate import provenance

KEPT_JSON = Path(__file__).with_name("scaling.json")
BEFORE_JSON = Path(__file__).with_name("scaling_before.json")
PAGE = ROOT / "docs" / "scaling.md"
SCRATCH = ROOT / "results" / "benchmarks"
EXECUTED, LINKED = (10, 100, 1_000), (10_000,)
ALONE_UP_TO = 100
"""Runs up to which three jobs a run are executed too."""
CORES = 2


def measure(sizes: tuple[int, ...], linked: tuple[int, ...], peer_runs: int) -> dict[str, Any]:
    """Measure all sizes.

    Parameters
    ----------
    sizes : tuple of int
        Numbers of runs that are executed.
    linked : tuple of int
        Numbers of runs that are planned, collected and reported but not computed.
    peer_runs : int
        Runs of the comparison with other tools.
    """
    begun, load = time.time(), os.getloadavg()[0]
    place = Place(SCRATCH / "scaling")
    scenario = open_plan(place.study(1)).runs[0].scenario
    origin = provenance(scenario)
    # The machine is calibrated and kernels are compiled once, before anything counts.
    place.snakemake(place.study(1), "--cores", "1", shared=False)
    rows: dict[str, Any] = {}
    for runs in sizes:
        said(f"{runs} runs")
        study = place.study(runs)
        row = {
            **planned(place, study),
            **graphs(place, study),
            "job_start": job_start(place, study),
        }
        if runs <= ALONE_UP_TO:
            row["run_alone"] = executed(place, runs, study, False, CORES)
        row["run_shared"] = executed(place, runs, study, True, CORES)
        row |= {"files": files(place, runs), **finished(place, runs, study)}
        rows[str(runs)] = row | appended(place, runs)
    said("parts of a run")
    found_parts = parts(place, sizes[0])
    for runs in linked:
        said(f"{runs} runs, with the products of {sizes[-1]}")
        row = grafted(place, runs, sizes[-1])
        study = place.study(runs)
        row["job_start"] = job_start(place, study)
        rows[str(runs)] = row | finished(place, runs, study) | appended(place, runs)
    said("peers")
    beside = peers(SCRATCH / "peers", peer_runs, CORES)
    return {
        "rows": rows,
        "before": json.loads(BEFORE_JSON.read_text(encoding="utf-8")),
        "parts": found_parts,
        "peers": beside,
        "took_s": round(time.time() - begun),
        "load_before": load,
        "load_after": os.getloadavg()[0],
        "provenance": origin,
    }


def rounded(tree: Any) -> Any:
    """A tree with its times to a tenth of a millisecond."""
    if isinstance(tree, dict):
        return {key: rounded(value) for key, value in tree.items()}
    return round(tree, 4) if isinstance(tree, float) else tree


def said(what: str) -> None:
    """Tell what is measured now."""
    print(f"{time.strftime('%H:%M:%S')} {what}", file=sys.stderr, flush=True)


def main(arguments: list[str]) -> None:
    """Measure, keep and write the page."""
    quick = "--quick" in arguments
    kept, shown = (SCRATCH / KEPT_JSON.name, SCRATCH / PAGE.name) if quick else (KEPT_JSON, PAGE)
    if "--page" not in arguments:
        brief = EXECUTED[:2], EXECUTED[2:] + LINKED, 40
        few = (3, 10), (30,), 10
        whole = EXECUTED, LINKED, 100
        found = measure(*(few if quick else brief if "--brief" in arguments else whole))
        kept.write_text(json.dumps(rounded(found), indent=1) + "\n", encoding="utf-8")
    found = json.loads(kept.read_text(encoding="utf-8"))
    shown.write_text(page(found), encoding="utf-8")
    draw(found, shown.with_suffix(".png"))
    print(shown)


if __name__ == "__main__":
    main(sys.argv[1:])
