"""Solidification: the paper's cases, where the ways fail, and error against cost.

``make solidification`` runs ``python -m benchmarks.arpm``, which writes docs/solidification.md and
its pictures; with ``--quick`` plates are coarse.
"""

from __future__ import annotations

import os
from typing import Any, NamedTuple

from benchmarks.arpm.charts import draw
from benchmarks.arpm.contact import contact_rows
from benchmarks.arpm.fields import draw_fields
from benchmarks.arpm.limits import jump_rows, scatter_rows, step_rows
from benchmarks.arpm.page import failures, page
from benchmarks.arpm.space import REFERENCE_MM, space_rows
from benchmarks.arpm.ways import way_rows
from benchmarks.frame import Benchmark, BenchmarkRun
from sandmould.casting.arpm import source_hash
from tests.verification.castings.plates import read_plates


class ElementSizes(NamedTuple):
    """Smallest elements."""

    plates_mm: float
    space_mm: float


def origin(run: BenchmarkRun) -> dict[str, Any]:
    """Where and with what a part is computed."""
    return {
        "machine": run.origin["machine"], "commit": run.origin["commit"], "solver": source_hash(),
        "load_before": round(os.getloadavg()[0], 1),
    }  # fmt: skip


def limits(run: BenchmarkRun) -> dict[str, Any]:
    """Compute where the ways fail."""
    start = origin(run)
    return start | {"steps": step_rows(), "jumps": jump_rows(), "scatter": scatter_rows()}


def ways(run: BenchmarkRun) -> dict[str, Any]:
    """Compute error against cost in 2D."""
    return origin(run) | {"rows": way_rows(read_plates(), run.extent.plates_mm)}


def space(run: BenchmarkRun) -> dict[str, Any]:
    """Compute error against cost in 3D."""
    return origin(run) | {"rows": space_rows(read_plates().filling, run.extent.space_mm)}


def fields(run: BenchmarkRun) -> dict[str, Any]:
    """Draw temperatures, which are computed for that alone."""
    start = origin(run)
    run.folder.mkdir(parents=True, exist_ok=True)
    picture = run.folder / "solidification_fields.png"
    draw_fields(read_plates(), 1e-3 * run.extent.plates_mm, picture)
    return start


BENCHMARK = Benchmark(
    __file__,
    __doc__,
    parts={
        "contact": lambda run: origin(run) | {"rows": contact_rows()},
        "limits": limits,
        "ways": ways,
        "space": space,
        "fields": fields,
    },
    pages={
        "solidification.md": page,
        "developers/solidification_limits.md": failures,
    },
    draw=draw,
    extent=ElementSizes(1.0, REFERENCE_MM),
    quick=ElementSizes(5.0, 2.0),
)

if __name__ == "__main__":
    BENCHMARK.command()
