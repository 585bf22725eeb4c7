"""The picture of docs/developers/workflow_cost.md."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import matplotlib
from matplotlib.figure import Figure

matplotlib.use("Agg")
LINES = {
    "graph, three jobs a run": ("graph_alone", "#D55E00", "s"),
    "report": ("report", "#CC79A7", "^"),
    "collection": ("collect", "#009E73", "D"),
    "graph, shared jobs": ("graph_shared", "#E69F00", "v"),
    "nothing to be done": ("nothing_to_do", "#56B4E9", "o"),
    "status": ("status", "#999999", "P"),
}


def draw(results: dict[str, Any], out: Path) -> None:
    """Draw what grows with the number of runs."""
    figure = Figure(figsize=(6.5, 4.2), dpi=130, layout="constrained")
    ax = figure.subplots()
    sizes = sorted(map(int, results["rows"]))
    for label, (name, colour, mark) in LINES.items():
        cpu_s = [results["rows"][str(n)][name]["cpu_s"] for n in sizes]
        ax.loglog(sizes, cpu_s, color=colour, marker=mark, label=label)
    plan_s = [
        sum(results["rows"][str(n)][name] for name in ("validate_s", "batches_s", "write_s"))
        for n in sizes
    ]
    ax.loglog(sizes, plan_s, color="#0072B2", marker="x", label="plan")
    ax.set(xlabel="runs of the study", ylabel="s of one core")
    ax.grid(alpha=0.3)
    ax.legend(fontsize=8, frameon=False)
    figure.savefig(out)
