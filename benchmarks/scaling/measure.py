"""What a study of so many runs costs: plan, graph, execution, tables, report, files."""

from __future__ import annotations

import shutil
import time
from collections.abc import Callable
from contextlib import chdir
from dataclasses import asdict
from pathlib import Path
from statistics import mean
from typing import Any

import pandas as pd

from benchmarks.scaling.study import REPLICATES, SHARED, Place, ProcessCost, graft
from sandmould.limits import RUNS
from sandmould.study.plan.announcement import announce
from sandmould.study.plan.build_plan import RESULTS, open_plan

_COLLECT = "from pathlib import Path; from sandmould.study.collect import collect; collect({0})"
_REPORT = (
    "from pathlib import Path; from sandmould.report.page import write_report; "
    "write_report({0}, {0} / 'report.html')"
)
Row = dict[str, Any]


def cpu_s(work: Callable[[], Any]) -> float:
    """Processor time of this process for some work."""
    begun = time.process_time()
    work()
    return time.process_time() - begun


def planned(place: Place, study: Path) -> Row:
    """Validate, expand and write a study in this process, then do it again."""
    shutil.rmtree(place.folder / RESULTS / study.stem, ignore_errors=True)
    with chdir(place.folder):
        validate_s = cpu_s(lambda: open_plan(study))
        plan = open_plan(study)
        batches_s = cpu_s(lambda: plan.batches(**SHARED))
        first_s, again_s = (cpu_s(lambda: announce(plan, RESULTS, 2)) for _ in range(2))
    return {
        "validate_s": validate_s,
        "batches_s": batches_s,
        "write_s": first_s,
        "write_again_s": again_s,
        "batches": len(plan.batches(**SHARED)),
    }


def graphs(place: Place, study: Path) -> Row:
    """Dry runs: Snakemake's graph with jobs shared, and with three jobs a run."""
    return {
        name: asdict(place.snakemake(study, "--cores", "2", "--dry-run", shared=shared))
        for name, shared in (("graph_shared", True), ("graph_alone", False))
    }


def executed(place: Place, runs: int, study: Path, shared: bool, cores: int) -> Row:
    """All of a study, from nothing to its report."""
    shutil.rmtree(place.results(runs), ignore_errors=True)
    shutil.rmtree(place.folder / ".snakemake", ignore_errors=True)
    cost = place.snakemake(study, "--cores", str(cores), shared=shared)
    summary = pd.read_csv(place.results(runs) / "summary.tsv", sep="\t")
    assert set(summary["outcome"]) == {"finished"}
    return {**asdict(cost), "cores": cores}


def finished(place: Place, runs: int, study: Path) -> Row:
    """What is done with a finished study: nothing, its state, its tables, its report."""
    folder = f"Path('results/{study.stem}')"
    return {
        "nothing_to_do": asdict(place.snakemake(study, "--cores", "2", shared=True)),
        "status": asdict(place.python("-m", "sandmould.cli", "status", study.name)),
        "collect": asdict(place.python("-c", _COLLECT.format(folder))),
        "report": asdict(place.python("-c", _REPORT.format(folder))),
        "report_bytes": (place.results(runs) / "report.html").stat().st_size,
    }


def appended(place: Place, runs: int) -> Row:
    """One more point of the sweep, which is so many runs, and its new report.

    Empty where a study may have no more runs.
    """
    if runs + REPLICATES > RUNS.most:
        return {}
    cost: ProcessCost = place.snakemake(
        place.study(runs, more_points=1), "--cores", "2", shared=True
    )
    place.study(runs)
    return {"append": {**asdict(cost), "runs": min(runs, REPLICATES)}}


def files(place: Place, runs: int) -> Row:
    """Files and bytes of a run, and what Snakemake keeps beside them."""
    folders = sorted((place.results(runs) / "runs").iterdir())
    own = [[p for p in f.rglob("*") if p.is_file()] for f in folders]
    logs = [p for p in (place.results(runs) / "logs").rglob("*") if p.is_file()]
    snakemakes = [p for p in (place.folder / ".snakemake").rglob("*") if p.is_file()]
    recorded = [[p for p in f if p.name == "snapshots.npz"] for f in own]
    return {
        "files": mean(len(f) for f in own),
        "of_snapshots": mean(len(f) for f in recorded),
        "bytes": mean(sum(p.stat().st_size for p in f) for f in own),
        "bytes_of_snapshots": mean(sum(p.stat().st_size for p in f) for f in recorded),
        "logs": len(logs) / len(folders),
        "of_snakemake": len(snakemakes) / len(folders),
    }


def grafted(place: Place, runs: int, source: int) -> Row:
    """A study too long to execute here, with the products of a shorter one.

    Its collection, check and report are made by Snakemake; its runs are not computed.
    """
    study = place.study(runs)
    row = {**planned(place, study), **graphs(place, study)}
    row["linked_files"] = graft(place, study, place.results(source))
    row["tables_and_report"] = asdict(place.snakemake(study, "--cores", "2", shared=True))
    return row
