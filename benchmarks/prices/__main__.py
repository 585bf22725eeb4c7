"""Planned against used: shipped studies of less than ten minutes, and records of longer ones.

``python -m benchmarks.prices`` compares all records whose scenarios are those of today with what
their plans foretell, and computes nothing: a minute of a core. ``--part fresh`` runs the studies
that are planned with less than ten minutes of one core: an hour and a half on a free one;
``--studies NAME ...`` chooses some, and keeps the rows of the others. Both write
docs/developers/prices.md.
"""

from __future__ import annotations

import json
import math
import os
import shutil
import subprocess
import sys
import time
from argparse import ArgumentParser
from collections.abc import Hashable, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import partial
from pathlib import Path
from typing import Any

from benchmarks.frame import SCRATCH, Benchmark, BenchmarkRun, children_s, render
from sandmould import ROOT
from sandmould.bad_input import BadInputError
from sandmould.definition.run import Run
from sandmould.execution.records import OLDER_SOLVER, RECORDS, runs_in, why_stale
from sandmould.kinds.kind import CORE_SECONDS, SpeedClass
from sandmould.kinds.registry import kind_of
from sandmould.runs.columns import CPU_S, FILL_CPU_S, RUN, WALL_S, finished, total_s
from sandmould.study.collect import read_summary
from sandmould.study.plan.announcement import known_prices, measure_speeds
from sandmould.study.plan.build_plan import Plan, open_plan
from sandmould.study.plan.fills import own_work, share_fills
from sandmould.study.plan.load_study import STUDIES, open_study
from sandmould.study.plan.price import BEGIN_S, END_S, Prices, foretold_s, study_s

SHORT_S = 600.0
CORES = 1
"""Its processor time can be compared whatever else the machine does."""
FILL, LOOP_WALL_S = "fill", "engine_wall_s"
FACTOR = 1.5
"""Within which a price should hold."""


@dataclass(frozen=True)
class Studies:
    """Which studies are run, and which records are read; all that fit where none is named."""

    fresh: tuple[str, ...] = ()
    records: tuple[str, ...] = ()


def _shipped() -> list[Path]:
    return sorted(STUDIES[0].glob("*.yaml"))


def _planned_s(plan: Plan, prices: Prices) -> float:
    every = (*plan.fills, *plan.runs)
    return study_s([prices.piece(run) for run in every], CORES)


def short_studies(results: Path) -> list[str]:
    """Shipped studies that are planned, at fixed speeds, with less than ten minutes."""
    found = []
    for path in _shipped():
        try:
            plan = open_plan(path, results)
        except BadInputError:
            continue  # it rests on another one, or its engine is not here
        if not plan.later and _planned_s(plan, Prices()) < SHORT_S:
            found.append(path.stem)
    return found


def fresh(run: BenchmarkRun) -> dict[str, dict[str, Any]]:
    """Run studies from nothing to their report."""
    scratch = SCRATCH / "prices"
    names = run.options.studies or run.extent.fresh or short_studies(scratch / "results")
    rows = {name: run.parts.get(f"run of {name}", partial(_row, name, scratch)) for name in names}
    return {**run.results.get("fresh", {}), **rows}


def _row(name: str, scratch: Path) -> dict[str, Any]:
    results = scratch / "results"
    shutil.rmtree(results / name, ignore_errors=True)
    path = STUDIES[0] / f"{name}.yaml"
    plan = open_plan(path, results)
    measure_speeds(plan, results)
    planned_s, load = _planned_s(plan, known_prices(plan, results)), os.getloadavg()[0]
    before_s, begun = children_s(), time.perf_counter()
    ran = subprocess.run(
        [sys.executable, "-m", "sandmould.cli", "run", str(path), "--cores", str(CORES)],
        cwd=scratch, capture_output=True, text=True, env=os.environ | {"PYTHONPATH": str(ROOT)},
    )  # fmt: skip
    wall_s, core_s = time.perf_counter() - begun, children_s() - before_s
    if ran.returncode and not (results / name / "report.html").exists():
        raise SystemExit(f"{name} failed:\n{ran.stderr[-2000:]}")
    table = read_summary(results / name)
    in_runs_s = total_s(table, CPU_S) if FILL_CPU_S in table else float(table[CPU_S].sum())
    row = {
        "runs": len(plan.runs), "planned_s": round(planned_s, 1), "core_s": round(core_s, 1),
        "wall_s": round(wall_s, 1), "beside_s": round(core_s - in_runs_s, 1),
        "load": round(load, 1),
    }  # fmt: skip
    print(name, row, flush=True)
    return row


def records(run: BenchmarkRun) -> dict[str, dict[str, Any]]:
    """Compare records with their plans; those of other scenarios than today's are left out."""
    names = run.extent.records or [path.parent.name for path in RECORDS.glob("*/record.json")]
    found = {name: _of_record(RECORDS / name) for name in sorted(names)}
    return {name: row for name, row in found.items() if row}


def _of_record(folder: Path) -> dict[str, Any]:
    """What a record's runs did and took, over what is foretold of them; empty where it is older."""
    if why_stale(folder) not in ("", OLDER_SOLVER):
        return {}
    said = json.loads((folder / "record.json").read_text(encoding="utf-8"))
    runs = runs_in(open_study(ROOT / said["study"]), folder)
    table = read_summary(folder)
    table = table[finished(table)].set_index(RUN)
    shared, _ = share_fills(runs, kind_of(runs[0].scenario).planning)
    # What a fill took is no row of its own: here each run counts with what it did itself.
    rows = {str(name): row for name, row in table.to_dict("index").items()}
    done = [
        (run if isinstance(rows[run.run].get(FILL), str) else replace(run, fill=""), rows[run.run])
        for run in shared
        if run.run in rows
    ]
    column = kind_of(runs[0].scenario).planning.work_unit.replace("-", "_")
    if not done or column not in table or column == CORE_SECONDS.replace("-", "_"):
        return {}
    work = [row[column] * _passes(row) for _, row in done]
    rates = dict(_rates(done, work))
    return {
        "runs": len(done),
        "work": round(sum(work) / sum(own_work(run) for run, _ in done), 3),
        "planned_s": round(sum(foretold_s(run, rates) for run, _ in done), 1),
        "wall_s": round(float(sum(row[WALL_S] for _, row in done)), 1),
        "unit": kind_of(runs[0].scenario).planning.work_unit,
        "commit": said["commit"],
    }


def _passes(row: Mapping[Hashable, Any]) -> float:
    """How often each window with a pattern was computed: records count its grain-steps once."""
    passes = float(row.get("pattern_passes", math.nan) / row.get("pattern_windows", math.nan))
    return passes if passes > 1.0 else 1.0


def _rates(
    done: Sequence[tuple[Run, Mapping[Hashable, Any]]], work: Sequence[float]
) -> Iterator[tuple[SpeedClass, float]]:
    """Work a second of each class as the record's own machine did it, per core."""
    classes: dict[SpeedClass, list[tuple[float, float]]] = {}
    for (run, row), done_work in zip(done, work, strict=True):
        planning = kind_of(run.scenario).planning
        core_s = row[LOOP_WALL_S] * planning.threads(run.scenario)
        classes.setdefault(planning.speed_class(run.scenario), []).append((done_work, core_s))
    for each, pairs in classes.items():
        all_work, all_s = map(sum, zip(*pairs, strict=True))
        yield each, all_work / all_s


def page(results: dict[str, Any]) -> str:
    """The page of the results."""
    values = {
        "fresh": {}, **results, "factor": FACTOR, "begin_and_end_s": BEGIN_S + END_S
    }  # fmt: skip
    return render(Path(__file__).with_name("page.md.j2"), values)


def _arranged(measured: dict[str, Any], run: BenchmarkRun) -> dict[str, Any]:
    origin = {key: run.origin[key] for key in ("commit", "machine")}
    return {**measured, **({"fresh_origin": origin} if "fresh" in measured else {})}


def _add_options(parser: ArgumentParser) -> None:
    parser.add_argument("--studies", nargs="+", metavar="NAME", help="run these alone")


BENCHMARK = Benchmark(
    __file__,
    __doc__,
    parts={"records": records, "fresh": fresh},
    by_default=("records",),
    pages={"developers/prices.md": page},
    extent=Studies(),
    quick=Studies(("tank_small",), ("tube_law_hold",)),
    arrange=_arranged,
    add_options=_add_options,
)

if __name__ == "__main__":
    BENCHMARK.command()
