"""The step loop of the solver beside that of an earlier commit, on the same beds in turns.

``python -m benchmarks.core_loop`` unpacks that commit from the repository, settles the beds and
writes docs/developers/core_loop.md. Times are processor times of one thread, so that a busy machine
does not spoil them.
"""

from __future__ import annotations

import json
import os
import subprocess
import sys
import tempfile
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from benchmarks.core_loop import turns
from benchmarks.engines.beds import Bed, scene, settled, tiled
from benchmarks.engines.timing import ratio, spread
from benchmarks.frame import SCRATCH, Benchmark, BenchmarkRun, render
from benchmarks.frame.source_tree import unpack
from sandmould import ROOT
from sandmould.dem.lanes import lanes_of_processor

BEFORE = "287d4133"
"""The commit that is compared with, the last whose loop is scalar."""
STEP_SHARE = 0.4
"""Step of both over the critical one of today: both allow it."""
COMPARED_STEPS = 300
"""After which places are compared: later, rounding grows."""


@dataclass(frozen=True)
class LoopExtent:
    """How much is measured."""

    turns: int = 9
    turn_s: float = 0.5
    discs: tuple[int, ...] = (4_000,)
    spheres: int = 8_000
    tiled_spheres: int = 40_000
    rest_discs: int = 100
    rest_s: float = 100.0
    """Simulated time of a bed at rest, and how many discs it has."""


TREES = SCRATCH / "core_loop"
"""Where the source trees of earlier commits are unpacked."""
QUICK = LoopExtent(2, 0.05, (300,), 300, 600, 100, 0.05)


@contextmanager
def started(trees: dict[str, Path], bed: Bed, motion: str) -> Iterator[dict[str, Any]]:
    """One process for each tree with the bed in it."""
    one = scene(bed.dimension, bed.grains, bed.width_m, bed.depth_m)
    step_s = STEP_SHARE * one.critical_step.step_s
    environment = os.environ | {"NUMBA_NUM_THREADS": "1", "OMP_NUM_THREADS": "1"}
    with tempfile.TemporaryDirectory() as name:
        bed_file = Path(name) / "bed.npz"
        np.savez(bed_file, **vars(bed))
        processes = {
            key: subprocess.Popen(
                [sys.executable, turns.__file__, str(tree), str(bed_file), motion, repr(step_s)],
                stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True, cwd=tree, env=environment,
            )
            for key, tree in trees.items()
        }  # fmt: skip
        try:
            yield processes
        finally:
            for process in processes.values():
                process.stdin.close()  # type: ignore[union-attr]
                process.wait()


def turn(process: Any, steps: int) -> dict[str, Any]:
    """One turn of one tree."""
    process.stdin.write(f"{steps}\n")
    process.stdin.flush()
    answer: dict[str, Any] = json.loads(process.stdout.readline())
    return answer


def apart_m(answers: dict[str, dict[str, Any]]) -> float:
    """Farthest distance between the places of a grain before and now."""
    before, now = (
        np.load(answers[name]["places"], allow_pickle=False) for name in ("before", "now")
    )
    return float(np.linalg.norm(now - before, axis=1).max())


def compare(bed: Bed, motion: str, extent: LoopExtent) -> dict[str, Any]:
    """Cost per grain-step before and now in turns, and how far places are apart."""
    with started({"before": unpack(BEFORE, TREES), "now": ROOT}, bed, motion) as both:
        for process in both.values():
            turn(process, 4)
        first = {name: turn(process, COMPARED_STEPS - 4) for name, process in both.items()}
        apart = apart_m(first)
        rate = (COMPARED_STEPS - 4) / first["before"]["took_s"]
        steps = max(20, round(rate * extent.turn_s))
        costs: dict[str, list[float]] = {name: [] for name in both}
        for _ in range(extent.turns):
            answers = {name: turn(process, steps) for name, process in both.items()}
            for name, answer in answers.items():
                costs[name].append(1e9 * answer["took_s"] / (steps * bed.grains))
    row = {
        "bed": bed.name,
        "motion": motion,
        "steps": steps,
        "fastest_m_s": answers["now"]["fastest_m_s"],
        "ns_per_grain_step": {name: spread(values) for name, values in costs.items()},
        "speedup": ratio(costs["before"], costs["now"]),
        "apart_m": apart,
    }
    print(row, flush=True)
    return row


def measure_beds(run: BenchmarkRun) -> list[dict[str, Any]]:
    """All beds, at rest and shaken."""
    extent: LoopExtent = run.extent
    beds = [settled(2, n) for n in extent.discs] + [settled(3, extent.spheres)]
    beds.append(tiled(beds[-1], extent.tiled_spheres))
    return [compare(bed, motion, extent) for bed in beds for motion in ("rest", "shaken")]


def measure_rest(run: BenchmarkRun) -> dict[str, Any]:
    """Drift of a small bed at rest over a long time, before and now."""
    extent: LoopExtent = run.extent
    bed = settled(2, extent.rest_discs)
    with started({"before": unpack(BEFORE, TREES), "now": ROOT}, bed, "rest") as both:
        step_s = {name: turn(process, 4)["step_s"] for name, process in both.items()}["now"]
        tenth = max(1, round(0.1 * extent.rest_s / step_s))
        marks = {name: [turn(p, tenth) for _ in range(10)] for name, p in both.items()}
    return {
        "bed": bed.name,
        "simulated_s": 10 * tenth * step_s,
        "mean_radius_m": float(bed.radius_m.mean()),
        "farthest_m": {n: [m["farthest_m"] for m in rows] for n, rows in marks.items()},
        "fastest_m_s": {n: rows[-1]["fastest_m_s"] for n, rows in marks.items()},
    }


def page(results: dict[str, Any]) -> str:
    """The page of the results."""
    return render(Path(__file__).with_name("page.md.j2"), {**results, "before": BEFORE})


BENCHMARK = Benchmark(
    __file__,
    __doc__,
    parts={"beds": measure_beds, "rest": measure_rest},
    pages={"developers/core_loop.md": page},
    extent=LoopExtent(),
    quick=QUICK,
    arrange=lambda measured, run: {
        **measured,
        "origin": run.origin,
        "turns": run.extent.turns,
        "lanes": len(lanes_of_processor()),
    },
)

if __name__ == "__main__":
    BENCHMARK.command()
