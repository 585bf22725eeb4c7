"""Charts of error over core time."""

from __future__ import annotations

from collections.abc import Sequence
from math import hypot, inf, isfinite
from pathlib import Path
from typing import Any

from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.patches import Rectangle
from matplotlib.ticker import LogLocator, NullFormatter

from benchmarks.speed_and_accuracy.method import Method, Panel, Point

MARKERS = "osD^vP*X<>hpd8"
COLOURS = ("#0072B2", "#D55E00", "#009E73", "#CC79A7", "#E69F00", "#56B4E9", "#555555")
"""Okabe and Ito's, which the colour-blind can tell apart; markers tell series apart too."""
FAILED: dict[str, Any] = {
    "facecolor": "#d0d0d0",
    "edgecolor": "#909090",
    "hatch": "///",
    "lw": 0,
    "zorder": 0,
}
LONG_NAME = 30
"""Legends with a longer name have one column."""
APART = 24.0
"""Least distance of two names, points of the picture."""
Styles = dict[str, tuple[str, str]]
"""Colour and marker by series."""


def draw(methods: Sequence[Method], folder: Path) -> None:
    """Draw a picture a method into a folder."""
    folder.mkdir(parents=True, exist_ok=True)
    for method in methods:
        number, styles = len(method.panels), _styles(method)
        has_memory = any(isfinite(p.memory_bytes) for m in method.panels for p in m.points)
        heights = [3.6, 1.0] if has_memory else [1.0]
        figure = Figure(figsize=(4.4 * max(number, 1.5), 4.6 + has_memory), layout="constrained")
        axes = figure.subplots(
            len(heights), number, squeeze=False, sharex="col", height_ratios=heights
        )
        for panel, (above, *below) in zip(method.panels, axes.T, strict=True):
            _draw_errors(above, panel, styles)
            for axis in below:
                _draw_memory(axis, panel, styles)
            (below or [above])[0].set_xlabel(panel.cost)
            has_long = max(map(len, above.get_legend_handles_labels()[1])) > LONG_NAME
            place = (0.5, -0.03 if below else -0.17)
            columns = 1 if has_long else 2
            above.legend(fontsize=7, loc="upper center", bbox_to_anchor=place, ncols=columns)
        figure.savefig(folder / f"{method.name}.png", dpi=100, metadata={"Software": None})


def _styles(method: Method) -> Styles:
    names = dict.fromkeys(point.series for panel in method.panels for point in panel.points)
    return {
        name: (COLOURS[k % len(COLOURS)], MARKERS[k % len(MARKERS)]) for k, name in enumerate(names)
    }


def _draw_errors(axis: Axes, panel: Panel, styles: Styles) -> None:
    for name in dict.fromkeys(point.series for point in panel.good):
        own = [point for point in panel.good if point.series == name]
        colour, marker = styles[name]
        axis.plot(*_places(own), ls="", marker=marker, ms=6, color=colour, label=name)
    front = panel.front
    axis.plot(*_places(front), color="black", lw=1.0, label="best (Pareto)", zorder=1)
    _draw_failed(axis, panel)
    axis.margins(0.18, 0.2)
    for side in ("x", "y") if panel.is_logarithmic else ("x",):
        _make_logarithmic(axis, side)
    if panel.fails_below_s:
        low = 0.6 * panel.fails_below_s
        axis.set_xlim(left=low)
        axis.axvspan(low, panel.fails_below_s, label="beyond the stability limit", **FAILED)
    _name(axis, front)
    axis.set_title(panel.title, fontsize=10)
    axis.set_ylabel(panel.error)
    axis.grid(alpha=0.3)


def _places(points: Sequence[Point]) -> tuple[list[float], list[float]]:
    return [p.core_s for p in points], [p.error for p in points]


def _make_logarithmic(axis: Axes, side: str) -> None:
    axis.set(**{f"{side}scale": "log"})
    low, high = axis.get_xlim() if side == "x" else axis.get_ylim()
    ticks = axis.xaxis if side == "x" else axis.yaxis
    ticks.set_major_locator(LogLocator(subs=(1.0, 2.0, 5.0) if high < 1e3 * low else (1.0,)))
    ticks.set_major_formatter("{x:g}")
    ticks.set_minor_formatter(NullFormatter())


def _name(axis: Axes, front: Sequence[Point]) -> None:
    """Write settings below the front, where no other point lies; no name on another."""
    last = (-inf, inf)
    for point in front:
        x, y = axis.transData.transform((point.core_s, point.error))
        if hypot(x - last[0], y - last[1]) < APART:
            continue
        last = (x, y)
        offset, side = ((4, 4), "left") if point is front[0] else ((-4, -12), "right")
        drawn: dict[str, Any] = {"textcoords": "offset points", "fontsize": 7, "ha": side}
        axis.annotate(point.label or point.series, (point.core_s, point.error), offset, **drawn)


def _draw_failed(axis: Axes, panel: Panel) -> None:
    """A strip at the top: what was computed without an answer, and why."""
    if not panel.failed:
        return
    label = f"failed: {', '.join(sorted({point.failure for point in panel.failed}))}"
    axis.add_patch(Rectangle((0.0, 0.91), 1.0, 0.09, transform=axis.transAxes, **FAILED))
    for point in panel.failed:
        strip = axis.get_xaxis_transform()
        axis.plot(point.core_s, 0.955, "x", color="black", transform=strip, label=label)
        label = ""


def _draw_memory(axis: Axes, panel: Panel, styles: Styles) -> None:
    axis.set_ylabel("memory, MB")
    axis.grid(alpha=0.3)
    points = [p for p in panel.good if isfinite(p.memory_bytes)]
    if not points:
        axis.set_yticks([])
        axis.text(0.5, 0.5, "not recorded", transform=axis.transAxes, ha="center", fontsize=8)
        return
    for point in points:
        colour, marker = styles[point.series]
        axis.plot(point.core_s, point.memory_bytes / 1e6, marker, ms=5, color=colour)
    axis.set_ylim(0, 1.25 * max(p.memory_bytes / 1e6 for p in points))
