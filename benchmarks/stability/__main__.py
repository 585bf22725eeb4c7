"""Where each engine loses stability: a map over time step and damping, and the exact limits.

``make stability`` runs ``python -m benchmarks.stability``, which writes docs/stability.md and
docs/developers/longer_steps.md.
"""

from __future__ import annotations

from functools import partial
from typing import Any

from benchmarks.frame import Benchmark, BenchmarkRun
from benchmarks.stability.bed_step import SCENES as FILLED
from benchmarks.stability.bed_step import paired_fillings
from benchmarks.stability.limits import (
    COARSE,
    WHOLE,
    engines_here,
    followed_beds,
    limit_row,
    map_of,
    one_contact_s,
    rotation,
)
from benchmarks.stability.page import longer_steps, page
from benchmarks.stability.scenes import SCENES, limits_of, start_of


def scenes(run: BenchmarkRun) -> dict[str, Any]:
    """Map every scene on every engine."""
    return {
        scene: {
            "grains": len(start_of(scene).mass_kg),
            "critical_s": float(f"{limits_of(scene, 0.0).whole.undamped_s:.6g}"),
            "limits": [limit_row(scene, zeta) for zeta in run.extent.damping_ratios],
            "maps": {
                engine: run.parts.get(f"{scene}, {engine}",
                                      partial(map_of, scene, engine, run.extent))
                for engine in engines_here()
            },
        }
        for scene in SCENES
    }  # fmt: skip


def arrange(measured: dict[str, Any], run: BenchmarkRun) -> dict[str, Any]:
    """Results with the engines and points they are of."""
    ratios = run.extent.damping_ratios
    return {
        "engines": engines_here(),
        "steps_over_critical": list(run.extent.steps_over_critical),
        "bed_one_contact_s": [float(f"{one_contact_s(zeta):.4g}") for zeta in ratios],
        **measured,
    }


BENCHMARK = Benchmark(
    __file__,
    __doc__,
    parts={
        "scenes": scenes,
        "bed_followed": lambda run: followed_beds(engines_here(), run.extent),
        "rotation": lambda run: rotation(run.extent),
        "fillings": lambda run: [
            run.parts.get(scene, partial(paired_fillings, scene)) for scene in FILLED
        ],
    },
    pages={"stability.md": page, "developers/longer_steps.md": longer_steps},
    extent=WHOLE,
    quick=COARSE,
    arrange=arrange,
)

if __name__ == "__main__":
    BENCHMARK.command()
