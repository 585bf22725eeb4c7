"""The picture of docs/developers/workflow_cost.md."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import matplotlib
import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from benchmarks.scaling.model import Assumed, WorkflowCosts, drain

matplotlib.use("Agg")
LINES = {
    "graph, three jobs a run": ("graph_alone", "#D55E00", "s"),
    "report": ("report", "#CC79A7", "^"),
    "collection": ("collect", "#009E73", "D"),
    "graph, shared jobs": ("graph_shared", "#E69F00", "v"),
    "nothing to be done": ("nothing_to_do", "#56B4E9", "o"),
    "status": ("status", "#999999", "P"),
}
RUN_S = {10: "#0072B2", 60: "#D55E00", 600: "#009E73"}
RUNS = 10_000


def draw(results: dict[str, Any], out: Path) -> None:
    """Draw what grows with the number of runs, and the modelled cluster."""
    figure = Figure(figsize=(10.5, 4.2), dpi=130, layout="constrained")
    left, right = figure.subplots(1, 2)
    _growth(left, results)
    _cluster(right, results)
    figure.savefig(out)


def _growth(ax: Axes, results: dict[str, Any]) -> None:
    sizes = sorted(map(int, results["rows"]))
    for label, (name, colour, mark) in LINES.items():
        cpu_s = [results["rows"][str(n)][name]["cpu_s"] for n in sizes]
        ax.loglog(sizes, cpu_s, color=colour, marker=mark, label=label)
    plan_s = [
        sum(results["rows"][str(n)][name] for name in ("validate_s", "batches_s", "write_s"))
        for n in sizes
    ]
    ax.loglog(sizes, plan_s, color="#0072B2", marker="x", label="plan")
    ax.set(xlabel="runs of the study", ylabel="s of one core", title="Measured on one machine")
    ax.grid(alpha=0.3)
    ax.legend(fontsize=8, frameon=False)


def _cluster(ax: Axes, results: dict[str, Any]) -> None:
    costs, on = WorkflowCosts.of(results), Assumed()
    batch_s = np.geomspace(15, 7200, 60)
    for run_s, colour in RUN_S.items():
        for cores, style in ((on.cores, "-"), (1, ":")):
            share = [100 * drain(RUNS, run_s, b, cores, costs, on).efficiency for b in batch_s]
            label = f"runs of {run_s} s, jobs of {cores} core{'s' if cores > 1 else ''}"
            ax.semilogx(batch_s, share, style, color=colour, label=label)
    ax.set(
        xlabel="batch_wall_s", ylabel="% of all cores in engine loops", ylim=(0, 100),
        title=f"Modelled: {RUNS:,} runs on {on.nodes} nodes of {on.cores}".replace(",", " "),
    )  # fmt: skip
    ax.grid(alpha=0.3)
    ax.legend(fontsize=8, frameon=False)
