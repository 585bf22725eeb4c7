"""How the workflow bears thousands of runs: ``python -m benchmarks.scaling``.

Writes scaling.json beside this file and docs/scaling.md with its picture. ``--quick`` shows with
few runs that everything works and writes to ``results/benchmarks``; ``--page`` writes the page of
scaling.json again. Takes an hour of two cores that have nothing else to do; the same command goes
on from where it was stopped. ``--brief`` executes no more than a hundred runs and compares with
peers on forty.
"""

from __future__ import annotations

import json
import os
import sys
import time
from collections.abc import Callable
from functools import partial
from pathlib import Path
from typing import Any

from benchmarks.scaling_chart import draw
from benchmarks.scaling_measure import appended, executed, files, finished, grafted, graphs, planned
from benchmarks.scaling_page import page
from benchmarks.scaling_parts import job_start, parts
from benchmarks.scaling_peers import peers
from benchmarks.scaling_study import Place
from sandmould import ROOT
from sandmould.runs.files import write_text
from sandmould.study.build_plan import open_plan
from sandmould.study.simulate import provenance

KEPT_JSON = Path(__file__).with_name("scaling.json")
BEFORE_JSON = Path(__file__).with_name("scaling_before.json")
PAGE = ROOT / "docs" / "scaling.md"
SCRATCH = ROOT / "results" / "benchmarks"
EXECUTED, LINKED = (10, 100, 1_000), (10_000,)
ALONE_UP_TO = 100
"""Runs up to which three jobs a run are executed too."""
CORES = 2


class Progress:
    """What is measured, kept as soon as it is: a benchmark that was stopped goes on from there.

    Parameters
    ----------
    path : Path
        Where it is kept.
    origin : dict
        Provenance. What another commit, machine or command measured is forgotten, and what
        was measured with changes that are in no commit.
    """

    def __init__(self, path: Path, origin: dict[str, Any]) -> None:
        self.path = path
        self.kept: dict[str, Any] = {
            "provenance": origin, "load_before": os.getloadavg()[0], "took_s": 0.0, "parts": {},
        }  # fmt: skip
        before = json.loads(path.read_text(encoding="utf-8")) if path.exists() else {}
        same = before.get("provenance") == origin
        self.goes_on = same and not origin["commit"].endswith("-dirty")
        if self.goes_on:
            self.kept = before

    def part(self, name: str, measure: Callable[[], Any]) -> Any:
        """Measure a part, or take what is kept of it."""
        parts = self.kept["parts"]
        if name not in parts:
            print(f"{time.strftime('%H:%M:%S')} {name}", file=sys.stderr, flush=True)
            begun = time.time()
            parts[name] = measure()
            self.kept["took_s"] += time.time() - begun
            write_text(self.path, json.dumps(self.kept))
        return parts[name]


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
    place = Place(SCRATCH / "scaling")
    origin = provenance(open_plan(place.study(1)).runs[0].scenario)
    progress = Progress(SCRATCH / "scaling_parts.json", origin)
    if not progress.goes_on:
        place.empty()
    # The machine is calibrated and kernels are compiled once, before anything counts.
    place.snakemake(place.study(1), "--cores", "1", shared=False)
    rows = {str(n): progress.part(f"{n} runs", partial(_executed, place, n)) for n in sizes}
    found_parts = progress.part("parts of a run", lambda: parts(place, sizes[0]))
    for n in linked:
        name = f"{n} runs, with the products of {sizes[-1]}"
        rows[str(n)] = progress.part(name, partial(_linked, place, n, sizes[-1]))
    beside = progress.part("peers", lambda: peers(SCRATCH / "peers", peer_runs, CORES))
    progress.path.unlink()
    return {
        "rows": rows,
        "before": json.loads(BEFORE_JSON.read_text(encoding="utf-8")),
        "parts": found_parts,
        "peers": beside,
        "took_s": round(progress.kept["took_s"]),
        "load_before": progress.kept["load_before"],
        "load_after": os.getloadavg()[0],
        "provenance": origin,
    }


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
    if isinstance(tree, dict):
        return {key: rounded(value) for key, value in tree.items()}
    return round(tree, 4) if isinstance(tree, float) else tree


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
