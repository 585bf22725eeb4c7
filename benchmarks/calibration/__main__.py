"""Calibration against its peers: the noise of one heap, runs needed, and coverage.

``make peers`` runs ``python -m benchmarks.calibration``, which writes
docs/developers/calibration_peers.md.
Runs of the part ``emulator`` come from the emulator of the study repose_map; those of the part
``dem`` are computed, and truths are planted by DEM too, in two measures of the same runs. Runs by
DEM are kept in results/benchmarks/calibration/runs: what was killed goes on from there.
"""

from __future__ import annotations

import argparse
from contextlib import ExitStack, closing
from dataclasses import replace
from pathlib import Path
from typing import Any

from benchmarks.calibration.measure import QUICK, WHOLE, measure
from benchmarks.calibration.methods import Nearest, Ours, PeerError, open_peers
from benchmarks.calibration.oracle import MAP, NoMapError, read_map
from benchmarks.calibration.page import page
from benchmarks.frame import Benchmark, BenchmarkRun
from sandmould import ROOT

PEERS = ROOT / ".venv-peers" / "bin" / "python"


def by_oracle(run: BenchmarkRun, oracle: str) -> dict[str, Any]:
    """Compare all methods on the runs of one oracle.

    Raises
    ------
    SystemExit
        With one sentence of what is missing.
    """
    extent = run.extent[oracle]
    if run.options.seeds is not None:
        extent = replace(extent, seeds=run.options.seeds)
    try:
        read_map(run.options.map)  # an error is raised before the peers start
        with ExitStack() as stack:
            peers = [stack.enter_context(closing(peer)) for peer in open_peers(PEERS)]
            return measure(run.options.map, [Ours(), *peers, Nearest()], extent)
    except (NoMapError, PeerError) as error:
        raise SystemExit(str(error)) from None


def add_options(parser: argparse.ArgumentParser) -> None:
    """Add what a calibration is started from."""
    parser.add_argument("--seeds", type=int, help="starts of each method, 0 for none")
    parser.add_argument("--map", type=Path, default=MAP, help="summary of the study repose_map")


BENCHMARK = Benchmark(
    __file__,
    __doc__,
    parts={
        "emulator": lambda run: by_oracle(run, "emulator"),
        "dem": lambda run: by_oracle(run, "dem"),
    },
    pages={"developers/calibration_peers.md": page},
    extent=WHOLE,
    quick=QUICK,
    by_default=("emulator",),
    add_options=add_options,
)

if __name__ == "__main__":
    BENCHMARK.command()
