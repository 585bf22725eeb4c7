"""Speed of the engines side by side, and of the reference engine against its targets.

``make benchmarks`` runs ``python -m benchmarks.engines``, which writes docs/developers/speed.md.
Nothing else should run on the machine meanwhile.
"""

from __future__ import annotations

import multiprocessing as mp
import os
from typing import Any

from benchmarks.engines.accuracy import measure_accuracy
from benchmarks.engines.beds import settled
from benchmarks.engines.machine import machine
from benchmarks.engines.page import page
from benchmarks.engines.rates import measure_bed
from benchmarks.engines.roofline import measure_roofline
from benchmarks.engines.scale import measure_scale, measure_threads
from benchmarks.engines.timing import QUICK, Extent, one_core
from benchmarks.frame import Benchmark, BenchmarkRun


def settle_all(extent: Extent) -> None:
    """Settle all beds that are not settled yet, side by side."""
    beds = [(3, extent.spheres)] + [(2, n) for n in {extent.tile, *extent.discs}]
    with mp.get_context("spawn").Pool(2) as pool:
        pool.starmap(settled, beds, chunksize=1)


def measure_rates(extent: Extent) -> list[dict[str, Any]]:
    """All engines on all settled beds, and on the smaller bed of discs shaken."""
    settle_all(extent)
    discs = [settled(2, n) for n in extent.discs]
    with one_core():
        rows = [measure_bed(bed, extent) for bed in (*discs, settled(3, extent.spheres))]
        return [*rows, measure_bed(discs[0], extent, shaken=True)]


def arrange(measured: dict[str, Any], run: BenchmarkRun) -> dict[str, Any]:
    """Results with what they were measured on, and how long that took."""
    return {
        **machine(run.origin), "load_average": run.load_before, **measured,
        "load_average_after": os.getloadavg()[0], "measured_s": round(run.took_s),
        "rounds": run.extent.rounds, "block_s": run.extent.block_s,
    }  # fmt: skip


BENCHMARK = Benchmark(
    __file__,
    __doc__,
    parts={
        "rates": lambda run: measure_rates(run.extent),
        "threads": lambda run: measure_threads(run.extent),
        "scale": lambda run: measure_scale(run.extent),
        "roofline": lambda run: measure_roofline(run.extent),
        "accuracy": lambda run: measure_accuracy(run.results["rates"][0], run.extent),
    },
    pages={"developers/speed.md": page},
    extent=Extent(),
    quick=QUICK,
    arrange=arrange,
)

if __name__ == "__main__":
    BENCHMARK.command()
