"""Memory, listings, threads, meshes and cost over size of the solver, beside an earlier commit.

``python -m benchmarks.size`` unpacks that commit from the repository, settles the beds and writes
docs/developers/size.md. Beds of all sizes are copies of one, side by side in both directions.
"""

from __future__ import annotations

import json
import os
import subprocess
import sys
import tempfile
from collections.abc import Iterator
from contextlib import ExitStack, contextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from benchmarks.core_loop.__main__ import TREES
from benchmarks.engines.beds import Bed, settled, tiled
from benchmarks.engines.timing import median_interval, ratio, spread
from benchmarks.frame import Benchmark, BenchmarkRun, render
from benchmarks.frame.source_tree import unpack
from benchmarks.size import worker
from benchmarks.size.mesh import Mesh, rested, round_pattern
from sandmould import ROOT

BEFORE = "3d986c9"
"""The commit that is compared with."""


@dataclass(frozen=True)
class SizeExtent:
    """How much is measured."""

    turns: int = 5
    turn_s: float = 0.2
    spheres: int = 2_000
    """Of the bed that is copied."""
    row_spheres: int = 300
    """Of the bed that is copied in one row: many of its grains touch a wall."""
    copies: int = 8
    """Copies of the spheres in each direction where memory and listings are measured."""
    shaken_steps: int = 300
    thread_copies: tuple[int, ...] = (4, 8)
    scale_copies: tuple[int, ...] = (2, 4, 8, 16, 32)
    scale_turns: int = 12
    """Enough for a 95 % interval of the median that leaves out the two turns at either end."""
    scale_steps: int = 1_000
    """At least, in all turns on a bed of any size: a turn of few steps is mostly its beginning."""
    mesh_copies: int = 4
    mesh_cuts: int = 92
    """Of each face of the cube that becomes the pattern; 12 times the square are the triangles."""
    fall_s: float = 0.06
    rest_s: float = 0.01
    """Until grains round the pattern rest again."""


QUICK = SizeExtent(2, 0.05, 300, 300, 2, 50, (2,), (1, 2), 2, 20, 2, 10, 1e-4, 1e-4)


def copied(bed: Bed, copies: int) -> Bed:
    """Copies of a bed of spheres side by side, as many in both directions."""
    steps = bed.width_m * np.arange(copies)
    shift = np.stack([*np.meshgrid(steps, steps), np.zeros((copies, copies))], axis=-1)
    position = (bed.position_m + shift.reshape(-1, 1, 3)).reshape(-1, 3)
    many = copies * copies
    return Bed(
        3,
        copies * bed.width_m,
        copies * bed.depth_m,
        position,
        np.tile(bed.velocity_m_s, (many, 1)),
        np.tile(bed.spin_rad_s, (many, 1)),
        np.tile(bed.radius_m, many),
    )


@contextmanager
def started(
    trees: dict[str, Path], bed: Bed, threads: int = 1, mesh: Mesh | None = None
) -> Iterator[dict[str, Any]]:
    """One process for each tree with the bed in it, round a pattern or not."""
    environment = os.environ | {"NUMBA_NUM_THREADS": "1", "OMP_NUM_THREADS": "1"}
    with tempfile.TemporaryDirectory() as name:
        bed_file = Path(name) / "bed.npz"
        np.savez(bed_file, **vars(bed))
        bed_and_mesh = [str(bed_file), str(threads)]
        if mesh:
            np.savez(Path(name) / "mesh.npz", **mesh._asdict())
            bed_and_mesh.append(str(Path(name) / "mesh.npz"))
        processes = {
            key: subprocess.Popen(
                [sys.executable, worker.__file__, str(tree), *bed_and_mesh],
                stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True, cwd=tree, env=environment,
            )
            for key, tree in trees.items()
        }  # fmt: skip
        try:
            for process in processes.values():
                process.stdout.readline()  # type: ignore[union-attr]
            yield processes
        finally:
            for process in processes.values():
                process.stdin.close()  # type: ignore[union-attr]
                process.wait()


def ask(process: Any, what: str, number: int = 0) -> dict[str, Any]:
    """An answer of a worker."""
    process.stdin.write(f"{what} {number}\n")
    process.stdin.flush()
    answer: dict[str, Any] = json.loads(process.stdout.readline())
    return answer


def _both() -> dict[str, Path]:
    return {"before": unpack(BEFORE, TREES), "now": ROOT}


def _steps(extent: SizeExtent, bed: Bed) -> int:
    """Steps of about a turn."""
    return max(10, round(extent.turn_s / (80e-9 * bed.grains)))


def _in_turns(
    processes: dict[str, Any], bed: Bed, steps: int, turns: int
) -> dict[str, list[float]]:
    """Wall time of a grain-step in each turn, ns; a turn before is not counted."""
    costs: dict[str, list[float]] = {name: [] for name in processes}
    for turn in range(turns + 1):
        for name, process in processes.items():
            spent_s = ask(process, "advance", steps)["wall_s"]
            if turn:
                costs[name].append(1e9 * spent_s / (steps * bed.grains))
    return costs


def measure_memory(run: BenchmarkRun) -> list[dict[str, Any]]:
    """Bytes per grain before and now, at rest and then shaken; one process at a time."""
    extent: SizeExtent = run.extent
    many = extent.copies**2 * extent.spheres
    beds = {
        "side by side": copied(settled(3, extent.spheres), extent.copies),
        "in one row": tiled(settled(3, extent.row_spheres), many * 3 // 4),
    }
    rows = []
    for laid, bed in beds.items():
        found: dict[str, dict[str, Any]] = {"at rest": {}, "shaken": {}}
        for tree, folder in _both().items():
            with started({tree: folder}, bed) as processes:
                process = processes[tree]
                for state, motion in (("at rest", "advance"), ("shaken", "shake")):
                    checksum = ask(process, motion, extent.shaken_steps)["checksum"]
                    answer = ask(process, "memory")
                    found[state][tree] = {
                        "checksum": checksum,
                        "arrays": {k: v / bed.grains for k, v in answer.pop("arrays").items()},
                        **{k: v / bed.grains for k, v in answer.items()},
                    }
        for state, both in found.items():
            same = both["before"]["checksum"] == both["now"]["checksum"]
            rows.append({"bed": bed.name, "laid": laid, "state": state, "same": same, **both})
            print(bed.name, laid, state, sum(both["now"]["arrays"].values()), flush=True)
    return rows


def measure_listing(run: BenchmarkRun) -> list[dict[str, Any]]:
    """Processor time of a listing in turns."""
    extent: SizeExtent = run.extent
    beds = (
        copied(settled(3, extent.spheres), extent.copies // 2),
        copied(settled(3, extent.spheres), extent.copies),
    )
    rows = []
    for bed in beds:
        costs: dict[str, list[float]] = {"before": [], "now": []}
        with started(_both(), bed) as both:
            for process in both.values():
                ask(process, "list", 2)
            times = max(2, round(extent.turn_s / (800e-9 * bed.grains)))
            for _ in range(extent.turns):
                for name, process in both.items():
                    cpu_s = ask(process, "list", times)["cpu_s"]
                    costs[name].append(1e9 * cpu_s / bed.grains)
        rows.append({
            "bed": bed.name,
            "ns_per_grain": {name: spread(values) for name, values in costs.items()},
            "ratio": ratio(costs["now"], costs["before"]),
        })  # fmt: skip
        print(rows[-1], flush=True)
    return rows


def measure_threads(run: BenchmarkRun) -> list[dict[str, Any]]:
    """Wall time of one and of two threads, before and now, in turns."""
    extent: SizeExtent = run.extent
    rows = []
    for copies in extent.thread_copies:
        bed = copied(settled(3, extent.spheres), copies)
        with started(_both(), bed) as one, started(_both(), bed, 2) as two:
            processes = {f"{k} {n}": p for n, s in ((1, one), (2, two)) for k, p in s.items()}
            costs = _in_turns(processes, bed, _steps(extent, bed), extent.turns)
        rows.append({
            "bed": bed.name,
            "ns_per_grain_step": {name: spread(values) for name, values in costs.items()},
            "speedup": {k: ratio(costs[f"{k} 1"], costs[f"{k} 2"]) for k in ("before", "now")},
            "load": os.getloadavg()[0],
        })  # fmt: skip
        print(rows[-1], flush=True)
    return rows


def measure_scale(run: BenchmarkRun) -> dict[str, Any]:
    """Processor time per grain-step of beds of several sizes, before and now, all in turns."""
    extent: SizeExtent = run.extent
    source = settled(3, extent.spheres)
    least_steps = extent.scale_steps // extent.scale_turns
    costs: dict[tuple[str, str], list[float]] = {}
    with ExitStack() as stack:
        beds = {}
        for copies in extent.scale_copies:
            bed = copied(source, copies)
            processes = stack.enter_context(started(_both(), bed))
            beds[bed.name] = (processes, bed.grains, max(least_steps, _steps(extent, bed)))
        for turn in range(extent.scale_turns + 1):
            for name, (processes, grains, steps) in beds.items():
                for tree, process in processes.items():
                    spent_s = ask(process, "advance", steps)["cpu_s"]
                    if turn:
                        cost = 1e9 * spent_s / (steps * grains)
                        costs.setdefault((name, tree), []).append(cost)
            print(f"turn {turn} of {extent.scale_turns}", flush=True)
    now = {name: costs[name, "now"] for name in beds}
    by_cost = sorted(now.values(), key=np.median)
    return {
        "beds": [
            {
                "bed": name,
                "steps": steps * extent.scale_turns,
                "ns_per_grain_step": {t: spread(costs[name, t]) for t in ("before", "now")},
                "ratio": ratio(now[name], costs[name, "before"]),
            }
            for name, (_, _, steps) in beds.items()
        ],
        "turns": extent.scale_turns,
        "dearest_over_cheapest": median_interval(
            [a / b for a, b in zip(by_cost[-1], by_cost[0], strict=True)]
        ),
    }


def measure_mesh(run: BenchmarkRun) -> list[dict[str, Any]]:
    """Processor time of a step and of a listing, of the box alone and round a fine mesh."""
    extent: SizeExtent = run.extent
    plain = copied(settled(3, extent.spheres), extent.mesh_copies)
    cut, mesh = round_pattern(plain, extent.mesh_cuts)
    cut = rested(cut, mesh, extent.fall_s, extent.rest_s)
    rows = []
    with started(_both(), plain) as boxes, started(_both(), cut, 1, mesh) as meshes:
        processes = {
            f"{k} {n}": p for n, s in (("box", boxes), ("mesh", meshes)) for k, p in s.items()
        }
        grains = {name: (cut if "mesh" in name else plain).grains for name in processes}
        same = len({
            ask(meshes[name], "advance", 200)["checksum"] for name in meshes
        }) == 1  # fmt: skip
        for process in processes.values():
            ask(process, "list", 2)
            ask(process, "advance", 20)
        touching = {
            name: ask(process, "touching")["contacts"] / grains[name]
            for name, process in processes.items()
        }
        for what in ("step", "listing"):
            costs: dict[str, list[float]] = {name: [] for name in processes}
            for _ in range(extent.turns):
                for name, process in processes.items():
                    times = _steps(extent, plain) if what == "step" else 3
                    answer = ask(process, "advance" if what == "step" else "list", times)
                    scale = times if what == "step" else 1
                    costs[name].append(1e9 * answer["cpu_s"] / (scale * grains[name]))
            rows.append({
                "what": what,
                "grains": cut.grains,
                "triangles": len(mesh.facets),
                "ns_per_grain": {name: spread(values) for name, values in costs.items()},
                "ratio": {k: ratio(costs[f"{k} mesh"], costs[f"{k} box"]) for k in meshes},
                "touching": touching,
                "same_digits": same,
            })  # fmt: skip
            print(rows[-1], flush=True)
    return rows


def page(results: dict[str, Any]) -> str:
    """The page of the results."""
    return render(Path(__file__).with_name("page.md.j2"), {**results, "before": BEFORE})


BENCHMARK = Benchmark(
    __file__,
    __doc__,
    parts={
        "memory": measure_memory,
        "listing": measure_listing,
        "mesh": measure_mesh,
        "scale": measure_scale,
        "threads": measure_threads,
    },
    pages={"developers/size.md": page},
    by_default=("memory", "listing", "mesh", "scale"),
    extent=SizeExtent(),
    quick=QUICK,
    arrange=lambda measured, run: {
        **measured,
        "measured": run.results.get("measured", {})
        | {name: {"commit": run.origin["commit"], "load": run.load_before} for name in measured},
        "origin": run.origin,
        "turns": run.extent.turns,
    },
)  # fmt: skip

if __name__ == "__main__":
    BENCHMARK.command()
