"""Error against cost of the ways to solidify the casting with four plates.

``python -m benchmarks.arpm`` writes arpm.json and arpm.png to results/benchmarks/; sizes are 2.5
times the paper's unless ``--full`` is given. Each way is compared with finite differences of half
the smallest size. Times are of the processor, on one thread.
"""

from __future__ import annotations

import argparse
import json
from pathlib import Path
from typing import Any

import matplotlib
from matplotlib.figure import Figure

from sandmould import ROOT
from sandmould.casting.arpm.method import Method
from sandmould.casting.arpm.plates_case import (
    SMALL_M,
    Plates,
    curve_error_percent,
    read_plates,
    run_plates,
)
from sandmould.casting.arpm.solidification import Solidification
from sandmould.scenario.scenario import Scenario
from sandmould.study.simulate import provenance

matplotlib.use("Agg")
OUT = ROOT / "results" / "benchmarks"
ADAPTIVE = "2-3B"
WARMING_S = 10.0
# the paper's, the corrected, the conservative, local and super steps, and the competitor
WAYS: dict[str, tuple[str, Method]] = {
    "uniform, corrected": ("2-1", Method("corrected", "explicit")),
    "adaptive, printed": (ADAPTIVE, Method("printed", "explicit")),
    "adaptive, corrected": (ADAPTIVE, Method("corrected", "explicit")),
    "adaptive, symmetric": (ADAPTIVE, Method("symmetric", "explicit")),
    "adaptive, faces": (ADAPTIVE, Method("faces", "explicit")),
    "adaptive, corrected, local steps": (ADAPTIVE, Method("corrected", "local")),
    "adaptive, faces, local steps": (ADAPTIVE, Method("faces", "local")),
    "adaptive, faces, super steps": (ADAPTIVE, Method("faces", "super")),
    "uniform, faces, local steps": ("2-1", Method("faces", "local")),
    "finite differences": ("2-1", Method("difference")),
}


def row_of(name: str, plates: Plates, size_m: float, reference: Solidification) -> dict[str, Any]:
    """Compute one way and compare it."""
    case, method = WAYS[name]
    run_plates(plates, case, method, 0.01, until_s=WARMING_S)  # compiled before it is timed
    run = run_plates(plates, case, method, size_m)
    found = run.found
    error = curve_error_percent(plates, found, reference)
    return {
        "way": name,
        "size_m": size_m,
        "elements": len(run.elements.size_m),
        "counts": {f"{size:g}": count for size, count in run.elements.counts().items()},
        "step_s": run.steps_s,
        "element_steps": found.heat.element_steps,
        "cpu_s": found.cpu_s,
        "solidification_time_s": found.solidification_time_s,
        "time_error_percent": 100.0
        * (found.solidification_time_s / reference.solidification_time_s - 1.0),
        "mean_error_percent": {name: mean for name, (mean, _) in error.items()},
        "largest_error_percent": {name: most for name, (_, most) in error.items()},
        "largest_drift_percent": float(abs(found.drift_percent).max()),
    }


def draw(rows: list[dict[str, Any]], path: Path) -> None:
    """Mean error at the thinnest plate over the processor's time."""
    figure = Figure(figsize=(8, 5), layout="constrained")
    axes = figure.subplots()
    for number, name in enumerate(WAYS):
        own = [row for row in rows if row["way"] == name]
        axes.loglog([row["cpu_s"] for row in own],
                    [row["mean_error_percent"]["A"] for row in own],
                    marker="osD^vP*X<>"[number], label=name)  # fmt: skip
    axes.set_xlabel("processor time, s")
    axes.set_ylabel("mean error of the cooling curve at A, % of 1530 K")
    axes.legend(fontsize=8)
    figure.savefig(path, dpi=120)


def main() -> None:
    """Measure, keep and draw."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--full", action="store_true", help="the paper's 2 mm against 1 mm")
    parser.add_argument("--ways", nargs="+", choices=sorted(WAYS), default=list(WAYS))
    asked = parser.parse_args()
    sizes = (0.005, SMALL_M) if asked.full else (0.01, 0.005)
    plates = read_plates()
    reference = run_plates(plates, "2-1", Method("difference"), 0.5 * sizes[-1]).found
    rows = []
    for name in asked.ways:
        for size_m in sizes:
            rows.append(row_of(name, plates, size_m, reference))
            row = rows[-1]
            print(f"{name}, {1000 * size_m:g} mm: {row['cpu_s']:.2f} s, "
                  f"{row['mean_error_percent']['A']:.3f} % at A, "
                  f"solid at {row['solidification_time_s']:.1f} s "
                  f"({row['time_error_percent']:+.2f} %), "
                  f"drift {row['largest_drift_percent']:.1e} %", flush=True)  # fmt: skip
    OUT.mkdir(parents=True, exist_ok=True)
    origin = provenance(Scenario())
    kept = {"machine": origin["machine"], "commit": origin["commit"],
            "reference_s": reference.solidification_time_s, "rows": rows}  # fmt: skip
    (OUT / "arpm.json").write_text(json.dumps(kept, indent=1) + "\n", encoding="utf-8")
    draw(rows, OUT / "arpm.png")
    print(f"The chart: {(OUT / 'arpm.png').relative_to(ROOT)}")


if __name__ == "__main__":
    main()
