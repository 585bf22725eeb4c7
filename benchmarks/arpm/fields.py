"""Temperatures of the plates at 1000 s as three layouts see them: Figures 7 and 10 of the paper."""

from __future__ import annotations

from pathlib import Path

import matplotlib
from matplotlib.figure import Figure

from benchmarks.frame import thousands
from sandmould.casting.arpm.method import HeatMethod
from tests.verification.castings.plates import Plates, PlatesRun, run_plates

matplotlib.use("Agg")
AT_S = 1000.0
LAYOUTS = (("2-1", 0.001, "faces"), ("2-2A", 0.002, "corrected"), ("2-3B", 0.002, "corrected"))
"""Case, smallest element in m, and exchange: those the paper shows."""
HALF_WIDTH_M, PANEL_POINTS = 0.3, 240.0
"""Half the width that is shown, and the width of a panel in print."""
DOT, CLOSED = 0.75, 1.2
"""Width of a dot over that of the smallest element, where there are several sizes and where not."""


def draw_fields(plates: Plates, least_m: float, path: Path) -> None:
    """Compute and draw them.

    Parameters
    ----------
    plates : Plates
    least_m : float, m
        No element is smaller, whatever the paper's are.
    path : Path
    """
    figure = Figure(figsize=(13, 4.6), layout="constrained")
    panels = figure.subplots(1, len(LAYOUTS), sharex=True, sharey=True)
    for panel, (case, size_m, exchange) in zip(panels, LAYOUTS, strict=True):
        method = HeatMethod(exchange, "local")  # type: ignore[arg-type]
        run = run_plates(plates, case, method, max(size_m, least_m), AT_S, AT_S)
        dots = _draw(panel, run, plates)
        panel.set_title(
            f"{case}, {1e3 * run.elements.size_m.min():g} mm, {exchange}: "
            f"{thousands(len(run.elements.size_m))} elements",
            fontsize=10,
        )
    panels[0].set_ylabel("y, m")
    figure.colorbar(dots, ax=panels, label=f"temperature after {AT_S:g} s, K")
    figure.savefig(path, dpi=120)


def _draw(panel: matplotlib.axes.Axes, run: PlatesRun, plates: Plates
          ) -> matplotlib.collections.PathCollection:  # fmt: skip
    """One small dot an element, whatever its size, as in the paper: their density is seen."""
    x, y = run.elements.position_m.T
    smallest_m, largest_m = run.elements.size_m.min(), run.elements.size_m.max()
    dot = DOT if smallest_m < largest_m else CLOSED
    width = dot * float(smallest_m) * PANEL_POINTS / (2.0 * HALF_WIDTH_M)
    panel.set_facecolor("0.8")
    dots = panel.scatter(
        x, y, c=run.result.heat.temperature_k, s=width**2, marker="s", linewidths=0, cmap="inferno",
        vmin=plates.filling.initial_k[0], vmax=plates.filling.initial_k[1], rasterized=True,
    )  # fmt: skip
    panel.set(
        xlim=(-HALF_WIDTH_M, HALF_WIDTH_M),
        ylim=(-HALF_WIDTH_M, HALF_WIDTH_M),
        aspect="equal",
        xlabel="x, m",
    )
    return dots
