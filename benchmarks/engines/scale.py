"""Cost per grain-step of the reference engine over scene size and threads, and its bytes."""

from __future__ import annotations

import multiprocessing as mp
import os
from collections.abc import Callable
from typing import Any

import numpy as np

from benchmarks.engines.beds import Bed, settled, solver_on, tiled
from benchmarks.engines.timing import (
    Extent,
    interleaved,
    one_core,
    ratio,
    seconds,
    spread,
    steps_lasting,
)
from sandmould.dem.solver import Solver

THREADS_TARGET = 0.85
SCALE_TARGET = 1.5


def advance(solver: Solver, steps: int) -> None:
    """Compute steps in a box at rest."""
    solver.advance(np.zeros(steps + 2))


def _rate(solver: Solver, steps: int) -> float:
    """Grain-steps per second."""
    return len(solver.grains.id) * steps / seconds(lambda: advance(solver, steps))


def _steps(solver: Solver, block_s: float) -> int:
    return steps_lasting(lambda steps: advance(solver, steps), block_s)


def cost_of(solver: Solver, steps: int) -> Callable[[], float]:
    """Give a block of steps whose value is ns per grain-step."""
    return lambda: 1e9 / _rate(solver, steps)


def _independent(core: int, bed: Bed, steps: int, rounds: int, start: Any, rates: Any) -> None:
    """Process with one thread on one core: as many blocks as rounds, each at a signal."""
    os.sched_setaffinity(0, {core})
    solver = solver_on(bed)
    advance(solver, max(4, steps // 4))
    for _ in range(rounds):
        start.wait()
        rates.put(_rate(solver, steps))


def measure_threads(extent: Extent) -> dict[str, Any]:
    """Two threads on one bed against two processes with one thread each, at the same time."""
    cores = sorted(os.sched_getaffinity(0))
    if len(cores) < 2:
        return {"missing": "this needs two cores"}
    bed = tiled(settled(2, extent.tile), extent.thread_discs)
    solver = solver_on(bed, threads=2)
    steps = _steps(solver, extent.block_s)
    context = mp.get_context("spawn")
    start, rates = context.Barrier(3), context.Queue()
    work = (bed, steps, extent.rounds, start, rates)
    others = [context.Process(target=_independent, args=(core, *work)) for core in cores[:2]]
    for other in others:
        other.start()

    def independent() -> float:
        start.wait(timeout=300)
        return sum(rates.get(timeout=300) for _ in others)

    blocks = {"threads": lambda: _rate(solver, steps), "processes": independent}
    measured = interleaved(blocks, extent.rounds)
    for other in others:
        other.join()
    return {
        "bed": bed.name,
        "steps": steps,
        "grain_steps_per_s": {name: spread(values) for name, values in measured.items()},
        "threads_over_processes": ratio(measured["threads"], measured["processes"]),
    }


def near_of(solver: Solver) -> int:
    """Near pairs now, with the empty lanes beside them."""
    near = solver.moving.near
    return int((near.last_row - near.first_row).sum()) * near.grain.shape[1] // 2


def bytes_of(solver: Solver) -> dict[str, int]:
    """Bytes of every array that the step loop is given."""
    moving = solver.moving
    parts: dict[str, Any] = {
        "grains": moving.grains,
        "pairs": moving.pairs,
        "near": moving.near,
        "walls candidates": moving.walls.candidates,
        "walls history": moving.walls.history,
    }
    sizes = {
        f"{part} {field}": array.nbytes
        for part, arrays in parts.items()
        for field, array in arrays._asdict().items()
    }
    others = {"ahead": moving.ahead, "walls loads": moving.walls.loads, "listed": moving.listed}
    return sizes | {name: array.nbytes for name, array in others.items()}


def _measure_sizes(tile: Bed, sizes: tuple[int, ...], extent: Extent) -> dict[str, Any]:
    """Cost per grain-step of beds of several sizes, on one core."""
    solvers = {str(n): solver_on(tiled(tile, n)) for n in sizes}
    with one_core():
        blocks = {n: cost_of(s, _steps(s, extent.block_s)) for n, s in solvers.items()}
        costs_by_size = interleaved(blocks, extent.rounds)
    costs = [spread(costs_by_size[str(n)]) for n in sizes]
    medians = [cost["median"] for cost in costs]
    return {
        "sizes": list(sizes),
        "ns_per_grain_step": costs,
        "dearest_over_cheapest": max(medians) / min(medians),
    }


def measure_scale(extent: Extent) -> dict[str, Any]:
    """Cost over size in 2D and in 3D."""
    return {
        "2": _measure_sizes(settled(2, extent.tile), extent.scale_discs, extent),
        "3": _measure_sizes(settled(3, extent.spheres), extent.scale_spheres, extent),
    }
