"""Rebound over damping ratio and step on all engines, and beds with both kinds of dashpot.

``make rebound`` runs ``python -m benchmarks.rebound``, which writes docs/developers/rebound.md.
"""

from __future__ import annotations

from functools import partial
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

from benchmarks.frame import Benchmark, BenchmarkRun, render
from benchmarks.rebound.filled_bed import bed, compared
from benchmarks.rebound.impacts import PHASES, Row, errors
from sandmould.runs.formatting import number
from sandmould.statistics.agreement import interval_text
from tests.verification.cases import closed_forms
from tests.verification.cases.bench import LARGE_M, SMALL_M
from tests.verification.cases.phases import rebounds

ENGINES = ("reference", "lammps", "liggghts")
DASHPOTS = ("plain", "corrected")


class ReboundExtent(NamedTuple):
    """How much is measured."""

    damping_ratios: tuple[float, ...]
    steps: tuple[float, ...]
    """Over sqrt(m/k) of the contact."""
    beds: int


WHOLE = ReboundExtent((0.2, 0.5, 0.8, 1.0), (0.05, 0.1, 0.2), 80)
LITTLE = ReboundExtent((1.0,), (0.2,), 2)


def impacts(run: BenchmarkRun) -> list[Row]:
    """Errors of impacts, two rows an engine, ratio, step and dashpot."""
    return [
        row
        for engine in ENGINES
        for ratio in run.extent.damping_ratios
        for step in run.extent.steps
        for dashpot in DASHPOTS
        for row in run.parts.get(
            f"{engine}, {ratio}, {step}, {dashpot}",
            partial(errors, engine, ratio, step, dashpot),
        )
    ]


def walls(run: BenchmarkRun) -> list[dict[str, Any]]:
    """Errors of the mean restitution at the floor, of grains of two sizes in one scene."""
    rows = []
    for engine in ENGINES:
        for step in run.extent.steps[1:] or run.extent.steps:
            row: dict[str, Any] = {"engine": engine, "step": step}
            for size, radius in (("small", SMALL_M), ("large", LARGE_M)):
                found = rebounds(engine, 2, 1.0, step, "corrected", radius)["floor"]
                exact = closed_forms.restitution(1.0, "total")
                row[size] = round(float(np.mean(found)) / exact - 1.0, 5)
            rows.append(row)
    return rows


def beds(run: BenchmarkRun) -> list[dict[str, dict[str, float]]]:
    """Measures of filled beds, a row a start."""
    return [
        run.parts.get(f"bed {seed}", partial(bed, seed)) for seed in range(1, run.extent.beds + 1)
    ]


def _apart(rows: list[Row]) -> float:
    """Largest difference of a mean from that of two grains on the reference engine."""
    first = {_setting(row): row for row in reversed(rows) if row["where"] == "pair"}
    return max(
        abs(row[name][0] - first[_setting(row)][name][0])
        for row in rows
        for name in ("restitution", "peak_overlap", "contact_time")
    )


def _setting(row: Row) -> tuple[float, float, str]:
    return row["damping_ratio"], row["step"], row["dashpot"]


def page(results: dict[str, Any]) -> str:
    """The page of the results."""
    return render(Path(__file__).with_name("page.md.j2"), {
        **results,
        "phases": PHASES,
        "apart": _apart(results["impacts"]),
        "compared": compared(results["beds"]),
        "number": number,
        "interval_text": interval_text,
    })  # fmt: skip


BENCHMARK = Benchmark(
    __file__,
    __doc__,
    parts={"impacts": impacts, "walls": walls, "beds": beds},
    pages={"developers/rebound.md": page},
    extent=WHOLE,
    quick=LITTLE,
)

if __name__ == "__main__":
    BENCHMARK.command()
