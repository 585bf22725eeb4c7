"""How fast a grain leaves a wall or another grain, by engine and time step.

``python -m benchmarks.rebound`` prints a line for each damping ratio and step: the exact speed over
that of the impact, then that from a wall and from another grain on each engine.
"""

from __future__ import annotations

import math

import numpy as np

from sandmould.scenario.module_main import run_main
from tests.verification.cases import closed_forms
from tests.verification.cases.bench import (
    LARGE_M,
    SMALL_M,
    Bench,
    law,
    mass_kg,
    scene,
    stiffness,
    vector,
)

ENGINES = ("lammps", "liggghts", "reference")
STEPS = (0.176, 0.05, 0.01)
"""Over sqrt(m/k) of the smaller grain; the first is 0.8 of the planned critical step."""
DAMPING_RATIOS = (0.84, 0.95, 1.0)
SPEED_M_S = 1e-5


def rebounds(engine: str, damping_ratio: float, step: float) -> tuple[float, float]:
    """Speed after over speed before: from a wall, and of two grains against each other.

    Parameters
    ----------
    engine : str
    damping_ratio : float
    step : float
        Over sqrt(m/k) of the smaller grain.
    """
    slowest_s, fastest_s = (
        math.sqrt(mass_kg(2, radius) / stiffness(2)) for radius in (LARGE_M, SMALL_M)
    )
    same = law(2, damping_ratio)
    given = scene(engine, 2, 4, (SMALL_M, LARGE_M), same, same, step * fastest_s)
    with Bench(given) as bench:
        (hits, falls), (apart, is_hit) = bench.by_size()
        place, velocity = np.zeros((4, 2)), np.zeros((4, 2))
        place[apart] = vector(2, 0.15, 0.15)
        place[falls] = vector(2, 0.03, SMALL_M)
        place[is_hit] = vector(2, 0.06, 0.06)
        place[hits] = vector(2, 0.06, 0.06 + SMALL_M + LARGE_M)
        velocity[[falls, hits]] = vector(2, 0.0, -SPEED_M_S)
        bench.place(place, velocity)
        after = bench.advance(60 * slowest_s).velocity_m_s[:, 1] / SPEED_M_S
    return float(after[falls]), float(after[hits] - after[is_hit])


def main() -> None:
    """Print the table."""
    for ratio in DAMPING_RATIOS:
        exact = closed_forms.restitution(ratio, "total")
        for step in STEPS:
            speeds = "; ".join(
                "{} {:.4f} {:.4f}".format(engine, *rebounds(engine, ratio, step))
                for engine in ENGINES
            )
            print(f"zeta {ratio:g}, step {step:g}, exact {exact:.4f}: {speeds}", flush=True)


if __name__ == "__main__":
    run_main(main, "python -m benchmarks.rebound")
