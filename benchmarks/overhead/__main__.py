"""What a run costs beside the engine's own loop, and whether a sweep keeps its cores busy.

``python -m benchmarks.overhead`` runs a study of one run of about ten minutes on one core through
snakemake and times recording and analysis on its own snapshots. ``--part sweep --sweep
results/STUDY SECONDS CORES`` adds how busy the cores were in a sweep that took SECONDS in all.
"""

from __future__ import annotations

import subprocess
import sys
import tempfile
import time
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pandas as pd

from benchmarks.frame import Benchmark, BenchmarkRun
from sandmould import ROOT
from sandmould.engines.guard import Guard
from sandmould.engines.snapshot import Snapshot
from sandmould.execution.simulate import provenance
from sandmould.kinds.sand.measure import measure_snapshot
from sandmould.study.plan.expand import expand
from sandmould.study.plan.load_study import open_study

STUDY = Path(__file__).with_name("ten_minutes.yaml")
REPEATS = 5


def median_s(work: Callable[[], Any]) -> float:
    """Median time of a few repeats."""
    times = []
    for _ in range(REPEATS):
        begun = time.perf_counter()
        work()
        times.append(time.perf_counter() - begun)
    return sorted(times)[REPEATS // 2]


def one_run() -> dict[str, Any]:
    """Run the ten-minute study and split its wall time."""
    results = ROOT / "results" / STUDY.stem
    if results.exists():
        raise SystemExit(f"{results} exists: remove it, a resumed run measures nothing.")
    snakemake = Path(sys.executable).parent / "snakemake"
    command = [str(snakemake), "--cores", "1", "--configfile", str(STUDY), "--quiet", "rules"]
    # Planned once before, so that the calibration of the machine is not counted.
    subprocess.run([*command, "-n"], cwd=ROOT, check=True, capture_output=True)
    begun = time.perf_counter()
    subprocess.run(command, cwd=ROOT, check=True)
    total_s = time.perf_counter() - begun
    cost = pd.read_csv(results / "summary.tsv", sep="\t").iloc[0]
    run = expand(open_study(STUDY))[0]
    folder = results / "runs" / run.run
    snapshot = Snapshot.load(max((folder / "snapshots").glob("*.npz")))
    guard = Guard(run.scenario)
    with tempfile.TemporaryDirectory() as name:
        saved = Path(name) / "snapshot.npz"
        parts = {
            "guard_s_per_record": median_s(lambda: guard.check(snapshot)),
            "save_s_per_snapshot": median_s(lambda: snapshot.save(saved)),
            "measure_s_per_snapshot": median_s(lambda: measure_snapshot(run.scenario, snapshot)),
            "bytes_per_snapshot": saved.stat().st_size,
        }
    return {
        "grains": int(cost.grains),
        "total_s": round(total_s, 2),
        "engine_s": round(float(cost.engine_wall_s), 2),
        "rest_s": round(total_s - float(cost.engine_wall_s), 2),
        "rest_fraction": round(1 - float(cost.engine_wall_s) / total_s, 4),
        "driver_s": round(float(cost.wall_s - cost.engine_wall_s), 2),
        "records": len(pd.read_csv(folder / "series.tsv", sep="\t")),
        "snapshots": len(list((folder / "snapshots").iterdir())),
        **{name: round(value, 6) for name, value in parts.items()},
        "provenance": provenance(run.scenario),
    }


def sweep_busy(folder: Path, total_s: float, cores: int) -> dict[str, Any]:
    """Share of the cores' time that the runs of a finished sweep filled."""
    summary = pd.read_csv(folder / "summary.tsv", sep="\t")
    busy_s = float((summary.wall_s * summary.ranks).sum())
    return {
        "study": folder.name,
        "runs": len(summary),
        "total_s": total_s,
        "cores": cores,
        "busy_fraction": round(busy_s / (total_s * cores), 3),
    }


def sweep(run: BenchmarkRun) -> dict[str, Any]:
    """Share of the cores' time in the sweep that the command line names.

    Raises
    ------
    SystemExit
        When it names none.
    """
    if run.options.sweep is None:
        raise SystemExit("the part sweep needs --sweep results/STUDY SECONDS CORES")
    folder, total_s, cores = run.options.sweep
    return sweep_busy(Path(folder), float(total_s), int(cores))


BENCHMARK = Benchmark(
    __file__,
    __doc__,
    parts={"one_run": lambda run: one_run(), "sweep": sweep},
    by_default=("one_run",),
    add_options=lambda parser: parser.add_argument(
        "--sweep", nargs=3, metavar=("FOLDER", "SECONDS", "CORES"), help="a finished sweep"
    ),
)

if __name__ == "__main__":
    BENCHMARK.command()
