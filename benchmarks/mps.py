"""Noise of pressure and velocity against cost: multiple relaxation and stabilised variants.

``python -m benchmarks.mps`` runs the still fluid of the MPS paper under each scheme and writes
mps.json and mps.png to results/benchmarks/. By default 0.3 s, which shows that everything works:
the paper runs 2 s, and schemes that are calm at first may not stay so.
"""

from __future__ import annotations

import argparse
import json
import os
import time
from pathlib import Path
from typing import Any

import matplotlib
from matplotlib.figure import Figure

from sandmould import ROOT
from sandmould.casting.mps.scheme import Scheme
from sandmould.casting.mps.stability import ideal_pa, run_still
from sandmould.scenario.scenario import Scenario
from sandmould.study.simulate import provenance

matplotlib.use("Agg")
OUT = ROOT / "results" / "benchmarks"
EXACT = 0.59
"""c_poi that undoes a long wave of compression at once: one over ``compression_gain``."""
FULL = 0.9
"""beta for sources of velocities: they let the density scatter by several percent, and 0.985 takes
that for a surface."""
SCHEMES = {
    "MR1-0.5": Scheme(2e-4, 1, 0.5),
    "MR2-0.5": Scheme(5e-4, 2, 0.5),
    "MR5-1.0": Scheme(1e-3, 5, 1.0),
    "MR5-0.5": Scheme(1e-3, 5, 0.5),
    "MR10-0.5": Scheme(2e-3, 10, 0.5),
    "MR1-0.59, 1 ms": Scheme(1e-3, 1, EXACT),
    "divergence, beta 0.985": Scheme(1e-3, 1, 1.0, source="divergence"),
    "divergence": Scheme(1e-3, 1, 1.0, source="divergence", surface=FULL),
    "divergence, corrected, shifted": Scheme(
        1e-3, 1, 1.0, source="divergence", gradient="corrected", surface=FULL, shifting=0.05
    ),
    "higher order": Scheme(1e-3, 1, EXACT, source="higher_order", surface=FULL),
    "error compensating": Scheme(1e-3, 1, EXACT, source="error_compensating", surface=FULL),
}


def measure(name: str, scheme: Scheme, duration_s: float) -> dict[str, Any]:
    """One scheme: noise, residual velocity and settling in the second half, and its cost."""
    begin = time.process_time()
    run = run_still(scheme, duration_s)
    cpu_s = time.process_time() - begin
    past = run.history
    later = past.time_s > 0.5 * duration_s
    found = {"scheme": name, "verdict": run.verdict.value, "stopped": run.stopped}
    if not later.any():
        return found
    pressure = past.particle_pressure_pa[later, -1]
    return found | {
        "cpu_s_per_simulated_s": cpu_s / float(past.time_s[-1]),
        "pressure_share": run.cost.pressure_s / run.cost.wall_s,
        "iterations_per_relaxation": run.cost.iterations / run.cost.steps / scheme.relaxations,
        "mean_pressure_over_ideal": float(pressure.mean() / ideal_pa()[-1]),
        "pressure_noise_pa": float(pressure.std()),
        "mean_speed_m_s": float(past.mean_speed_m_s[later].mean()),
        "largest_speed_m_s": float(past.largest_speed_m_s[later].max()),
        "mean_kinetic_energy_j_kg": float(past.kinetic_energy_j_kg[later].mean()),
        "top_m": float(past.top_m[-1]),
    }


def draw(rows: list[dict[str, Any]], path: Path) -> None:
    """Pressure noise and residual velocity against cost, one point a scheme."""
    figure = Figure(figsize=(11, 4.5), layout="constrained")
    axes = figure.subplots(1, 2)
    for axis, key, label in (
        (axes[0], "pressure_noise_pa", "standard deviation of pressure at 70 mm, Pa"),
        (axes[1], "mean_speed_m_s", "mean speed of fluid at rest, m/s"),
    ):
        for number, row in enumerate(rows):
            if key in row:
                point = (row["cpu_s_per_simulated_s"], row[key])
                axis.scatter(*point, s=24, color="C0" if row["scheme"].startswith("MR") else "C1")
                axis.annotate(
                    row["scheme"],
                    point,
                    xytext=(5, (3, -9)[number % 2]),
                    textcoords="offset points",
                    fontsize=8,
                )
        axis.margins(x=0.2)
        axis.set(xscale="log", yscale="log", ylabel=label)
        axis.set_xlabel("processor time for a simulated second, s")
    figure.savefig(path, dpi=120)


def main() -> None:
    """Run all schemes, write the numbers and the chart."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--duration-s", type=float, default=0.3)
    parser.add_argument("--to", type=Path, default=OUT, help="folder")
    asked = parser.parse_args()
    run_still(Scheme(), 2e-3)  # compiles
    rows = []
    for name, scheme in SCHEMES.items():
        rows.append(measure(name, scheme, asked.duration_s))
        print(json.dumps(rows[-1]), flush=True)
    numbers = {
        "duration_s": asked.duration_s,
        "load": os.getloadavg()[1],
        "provenance": provenance(Scenario()),
        "schemes": rows,
    }
    asked.to.mkdir(parents=True, exist_ok=True)
    (asked.to / "mps.json").write_text(json.dumps(numbers, indent=1) + "\n", encoding="utf-8")
    draw(rows, asked.to / "mps.png")


if __name__ == "__main__":
    main()
