"""Runs of the benchmark of metal flow: the still tank by scheme, and a large casting in 3D."""

from __future__ import annotations

import time
from collections.abc import Iterable
from typing import Any

from sandmould.casting.mps.scheme import Scheme
from sandmould.casting.mps.shoulder import open_shoulder
from sandmould.runs.products import peak_memory_bytes
from tests.verification.castings.still_fluid import ideal_pa, run_still

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
    "MR5-0.5, collisions": Scheme(1e-3, 5, 0.5, collision_distance=0.8),
    "MR10-0.5": Scheme(2e-3, 10, 0.5),
    "MR1-0.5, 0.5 ms": Scheme(5e-4, 1, 0.5),
    "MR1-0.5, 1 ms": Scheme(1e-3, 1, 0.5),
    "MR1-0.59, 1 ms": Scheme(1e-3, 1, EXACT),
    "divergence, beta 0.985": Scheme(1e-3, 1, 1.0, source="divergence"),
    "divergence": Scheme(1e-3, 1, 1.0, source="divergence", surface=FULL),
    "divergence, corrected, shifted": Scheme(
        1e-3, 1, 1.0, source="divergence", gradient="corrected", surface=FULL, shifting=0.05
    ),
    "higher order": Scheme(1e-3, 1, EXACT, source="higher_order", surface=FULL),
    "error compensating": Scheme(1e-3, 1, EXACT, source="error_compensating", surface=FULL),
}
LARGE_M = 1.15e-3
"""About 100 000 particles of metal in the paper's casting with a shoulder."""
LARGE_STEPS = 5


def scheme_rows(names: Iterable[str], duration_s: float) -> list[dict[str, Any]]:
    """Run the still tank by some of ``SCHEMES``."""
    run_still(Scheme(), 2e-3)  # compiles
    rows = []
    for name in names:
        rows.append(_measure(name, SCHEMES[name], duration_s))
        print(rows[-1], flush=True)
    return rows


def _measure(name: str, scheme: Scheme, duration_s: float) -> dict[str, Any]:
    """One scheme: noise, residual velocity and settling in the second half, and its cost."""
    begin = time.process_time()
    run = run_still(scheme, duration_s)
    cpu_s = time.process_time() - begin
    past = run.history
    later = past.time_s > 0.5 * duration_s
    row = {"scheme": name, "verdict": run.verdict.value, "stopped": run.stopped}
    if not later.any():
        return row
    pressure = past.particle_pressure_pa[later, -1]
    return row | {
        "relaxations": scheme.relaxations,
        "source": scheme.source,
        "cpu_s_per_simulated_s": cpu_s / float(past.time_s[-1]),
        "pressure_share": run.cost.pressure_s / run.cost.wall_s,
        "neighbours_share": run.cost.neighbours_s / run.cost.wall_s,
        "iterations_per_relaxation": run.cost.iterations / run.cost.steps / scheme.relaxations,
        "mean_pressure_over_ideal": float(pressure.mean() / ideal_pa()[-1]),
        "pressure_noise_pa": float(pressure.std()),
        "mean_speed_m_s": float(past.mean_speed_m_s[later].mean()),
        "largest_speed_m_s": float(past.largest_speed_m_s[later].max()),
        "mean_kinetic_energy_j_kg": float(past.kinetic_energy_j_kg[later].mean()),
        "top_m": float(past.top_m[-1]),
    }


def large_row() -> dict[str, Any]:
    """Steps of a full casting in 3D at MR5-0.5: time a step, solver's share, memory."""
    open_shoulder(5e-3, Scheme(), full=True).step()  # compiles
    flow = open_shoulder(LARGE_M, Scheme(), full=True)
    flow.step()  # lists candidates
    before, begin = flow.cost.iterations, time.process_time()
    wall_s, pressure_s = flow.cost.wall_s, flow.cost.pressure_s
    for _ in range(LARGE_STEPS):
        flow.step()
    return {
        "metal": int(flow.fluid.sum()),
        "particles": len(flow.fluid),
        "relaxations": flow.scheme.relaxations,
        "cpu_s_per_step": (time.process_time() - begin) / LARGE_STEPS,
        "pressure_share": (flow.cost.pressure_s - pressure_s) / (flow.cost.wall_s - wall_s),
        "iterations_per_step": (flow.cost.iterations - before) / LARGE_STEPS,
        "peak_memory_bytes": peak_memory_bytes(),
    }
