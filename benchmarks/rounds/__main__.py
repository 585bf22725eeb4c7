"""Rounds against plain sweeps of as many runs, on planted curves: ``python -m benchmarks.rounds``.

How often the interval holds the planted optimum, how wide it is, and how far the best setting is
from it. It prints the table of docs/explanation/statistics.md; nothing of it is simulated.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence

import numpy as np
import pandas as pd

from benchmarks.frame import table
from sandmould.module_main import run_main
from sandmould.statistics.optimum import Optimum, find_optimum, propose

KEY, MEASURE = "frequency_hz", "fill"
LOW_HZ, HIGH_HZ = 20.0, 100.0
SEEDS = 60
FIRST, REPLICATES, ROUNDS, RUNS = 6, 3, 4, 6
Curve = Callable[[float], float]


def even(best_hz: float) -> Curve:
    """A hill that is even in the logarithm of frequency."""
    return lambda f: 0.7 - 0.2 * math.log(f / best_hz) ** 2


def skew(best_hz: float) -> Curve:
    """A hill that rises steeply and falls slowly, as rates of filling may."""
    return lambda f: 0.9 * (f / best_hz) * math.exp(1 - f / best_hz) - 0.2


def computed(points: Sequence[tuple[float, int]], curve: Curve, sd: float, seed: int) -> list[dict]:
    """Planted runs; the noise of a run depends on its point, its replicate and the seed alone."""
    rows = []
    for f, replicate in points:
        noise = np.random.default_rng([seed, replicate, round(1000 * f)]).normal(0.0, sd)
        rows.append({KEY: f, "replicate": replicate, "outcome_code": 0, MEASURE: curve(f) + noise})
    return rows


def swept(number: int, replicates: int) -> list[tuple[float, int]]:
    """A sweep of equal ratios."""
    return [(float(f"{f:.3g}"), r) for f in np.geomspace(LOW_HZ, HIGH_HZ, number)
            for r in range(1, replicates + 1)]  # fmt: skip


def with_rounds(curve: Curve, sd: float, seed: int) -> Optimum:
    """A coarse sweep and its rounds."""
    rows = computed(swept(FIRST, REPLICATES), curve, sd, seed)
    for done in range(ROUNDS):
        runs = pd.DataFrame(rows)
        optimum = find_optimum(runs, [KEY], MEASURE, "larger", seed=done)
        chosen = [(p[KEY], r) for p, r in propose(optimum, runs, RUNS, seed=done)]
        rows += computed(chosen, curve, sd, seed)
    return find_optimum(pd.DataFrame(rows), [KEY], MEASURE, "larger", seed=ROUNDS)


def at_once(number: int, replicates: int) -> Callable[[Curve, float, int], Optimum]:
    """All runs as one sweep."""

    def sweep(curve: Curve, sd: float, seed: int) -> Optimum:
        rows = computed(swept(number, replicates), curve, sd, seed)
        return find_optimum(pd.DataFrame(rows), [KEY], MEASURE, "larger")

    return sweep


def main() -> None:
    """Plant, search, print."""
    runs = FIRST * REPLICATES + ROUNDS * RUNS
    ways = {
        f"sweep of {FIRST} x {REPLICATES}, {ROUNDS} rounds of {RUNS}": with_rounds,
        f"sweep of {FIRST} x {runs // FIRST}": at_once(FIRST, runs // FIRST),
        f"sweep of {runs // REPLICATES} x {REPLICATES}": at_once(runs // REPLICATES, REPLICATES),
    }
    rows = []
    for shape, best_hz in ((even, 45.0), (even, 33.0), (skew, 40.0)):
        for sd in (0.01, 0.03):
            for name, search in ways.items():
                optima = [search(shape(best_hz), sd, seed) for seed in range(SEEDS)]
                ends = [optimum.interval(KEY) for optimum in optima]
                held = sum(low <= best_hz <= high for low, high in ends)
                off = [abs(optimum.setting[KEY] - best_hz) for optimum in optima]
                rows.append([
                    f"{shape.__name__}, best at {best_hz:g} Hz", f"{sd:g}", name,
                    f"{held} of {SEEDS}",
                    f"{np.median([high - low for low, high in ends]):.1f}",
                    f"{np.median(off):.1f}",
                ])  # fmt: skip
    head = ["planted curve", "sd of a run", f"{runs} runs as", "interval holds the optimum",
            "its width, Hz, median", "best setting off by, Hz, median"]  # fmt: skip
    print(table(head, rows))


if __name__ == "__main__":
    run_main(main, "python -m benchmarks.rounds")
