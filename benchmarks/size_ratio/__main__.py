"""Whether small grains are trapped between large ones, and what that does to a filled box.

``make size-ratio`` runs ``python -m benchmarks.size_ratio``, which writes
docs/developers/size_ratio.md.
"""

from __future__ import annotations

from dataclasses import asdict
from functools import partial
from pathlib import Path
from typing import Any, NamedTuple

from benchmarks.frame import Benchmark, BenchmarkRun, render
from benchmarks.size_ratio.cost import cost
from benchmarks.size_ratio.filled_box import MARGINS, PLANES, box, compared, filled_box
from benchmarks.size_ratio.three_grains import STARTS, Groove, leaving_deg
from sandmould.engines.registry import engine_problem
from sandmould.runs.formatting import number
from sandmould.statistics.agreement import interval_text

BELOW_DEG = 95.0
"""Beyond the equator of the large grains nothing presses."""
ENGINES = {"reference": PLANES, "lammps": PLANES, "liggghts": PLANES[1:]}


class GrooveExtent(NamedTuple):
    """How much is measured."""

    grooves: tuple[tuple[float, float], ...]
    """Rolling arms, and ratios of the radii."""
    steps: tuple[float, ...]
    """The first on all engines, the others on the reference."""
    boxes: int
    turns: int


GROOVES = ((0.0, 3.3), (0.0, 5.0), (0.0, 10.0), (0.1, 3.3), (0.1, 5.0))
WHOLE = GrooveExtent(GROOVES, (0.2, 0.05), 12, 7)
LITTLE = GrooveExtent(GROOVES[1:2], (0.2,), 2, 1)


def grooves(run: BenchmarkRun) -> list[dict[str, Any]]:
    """Where small grains leave the groove, a row a setting."""
    rows = []
    for arm, ratio in run.extent.grooves:
        for step in run.extent.steps:
            for engine, planes in ENGINES.items():
                for plane in planes:
                    groove = Groove(engine, plane, ratio, arm, step)
                    if engine != "reference" and step != run.extent.steps[0]:
                        continue
                    if engine_problem(groove.scenario) is not None:
                        continue
                    rows.append(run.parts.get(f"groove, {groove}", partial(_row, groove)))
    return rows


def _row(groove: Groove) -> dict[str, Any]:
    angle = leaving_deg(groove)
    return {
        **asdict(groove),
        "exact_deg": round(float(groove.exact_deg().mean()), 2),
        "mean_deg": round(float(angle.mean()), 2),
        "most_deg": round(float(angle.max()), 2),
        "below": int((angle > BELOW_DEG).sum()),
    }


def boxes(run: BenchmarkRun) -> list[dict[str, dict[str, float]]]:
    """Measures of filled boxes, a row a start."""
    return [
        {plane: run.parts.get(f"box {seed}, {plane}", partial(box, plane, seed))
         for plane in PLANES}
        for seed in range(1, run.extent.boxes + 1)
    ]  # fmt: skip


def costs(run: BenchmarkRun) -> list[dict[str, Any]]:
    """What the mend costs on the engines that have it."""
    return [cost(engine, run.extent.turns) for engine in ("reference", "lammps")]


def page(results: dict[str, Any]) -> str:
    """The page of the results."""
    rows = {plane: [pair[plane] for pair in results["boxes"]] for plane in PLANES}
    sizes = [size.diameter_m for size in filled_box("half_step", 1).sand.classes(3)]
    return render(Path(__file__).with_name("page.md.j2"), {
        **results,
        "starts": STARTS,
        "compared": compared(rows),
        "margins": MARGINS,
        "class_ratio": sizes[-1] / sizes[0],
        "number": number,
        "interval_text": interval_text,
    })  # fmt: skip


BENCHMARK = Benchmark(
    __file__,
    __doc__,
    parts={"grooves": grooves, "boxes": boxes, "costs": costs},
    pages={"developers/size_ratio.md": page},
    extent=WHOLE,
    quick=LITTLE,
)

if __name__ == "__main__":
    BENCHMARK.command()
