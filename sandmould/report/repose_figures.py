"""Pictures of a repose study: the heap with its fitted lines, the map, ridges and posteriors."""

from __future__ import annotations

import math
from collections.abc import Sequence
from pathlib import Path

import numpy as np
import pandas as pd
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from sandmould.analysis.plots import draw_grains
from sandmould.analysis.repose import Slope
from sandmould.drawing.animation import evenly
from sandmould.drawing.figures import cut_m, panel, png
from sandmould.engines.snapshot import Snapshot
from sandmould.kinds.sand.moments import list_moments
from sandmould.kinds.sand.outflow import slopes
from sandmould.report.tables import ReportPicture
from sandmould.runs.columns import RUN
from sandmould.runs.formatting import number, titled
from sandmould.scenario.scenario import Scenario
from sandmould.statistics.calibration.posterior import axes_of, surface
from sandmould.statistics.calibration.sands import CalibratedSand
from sandmould.statistics.emulator import Emulator
from sandmould.statistics.evidence import usable_values
from sandmould.statistics.verdict import Verdict

_LINE = "#C00000"
_BANDS = ("#0072B2", "#D55E00", "#009E73", "#CC79A7", "#E69F00", "#56B4E9")
_MM = 1e3


def plotted(key: str, values: np.ndarray) -> np.ndarray:
    """A swept key as a person reads it: the rolling arm as its angle in degrees."""
    if key.endswith("rolling_arm_fraction"):
        return np.degrees(np.arctan(values))
    return values


def axis_title(key: str) -> str:
    """Title of the axis of a swept key as ``plotted``."""
    if key.endswith("rolling_arm_fraction"):
        return "rolling angle α, °"
    if key.endswith("grain_grain.friction"):
        return "sliding friction μ between grains"
    return titled(key)


def draw_heap(snapshot: Snapshot, scenario: Scenario, height_m: float) -> str:
    """Draw the sand with the lines fitted to the heap and to what stays in the hopper."""
    gate = scenario.gate

    def grains_and_lines(ax: Axes, sand: Snapshot) -> None:
        draw_grains(sand, ax, cut_m=cut_m(scenario))
        heap, stayed = slopes(scenario, sand)
        floor_m = 0.0 if gate is None else gate.centre_m[-1] + gate.size_m[-1] / 2
        for slope, level_m in ((heap, 0.0), (stayed, floor_m)):
            _draw_slope(ax, slope, level_m)

    return panel(snapshot, scenario, height_m, grains_and_lines)


def _draw_slope(ax: Axes, slope: Slope, level_m: float) -> None:
    """Lines of the flanks that lie in the plane shown, with their angles."""
    in_plane = {"left": -1.0, "right": 1.0, "0 deg": 1.0, "180 deg": -1.0}
    for flank in slope.flanks:
        side = in_plane.get(flank.name)
        if side is None or not math.isfinite(flank.angle_deg):
            continue
        x = _MM * (slope.axis_m[0] + side * np.array(flank.distance_m))
        z = _MM * (level_m + np.array(flank.height_m))
        ax.plot(x, z, color=_LINE, lw=2.5, zorder=7, solid_capstyle="round")
        ax.text(
            x.mean() + side * 0.02 * (ax.get_xlim()[1] - ax.get_xlim()[0]), z.mean() + 12.0,
            f"{flank.angle_deg:.1f}°", color=_LINE, fontsize=13, weight="bold", zorder=8,
            ha="left" if side > 0 else "right",
        )  # fmt: skip


def draw_map(
    emulator: Emulator, keys: tuple[str, str], title: str, points: np.ndarray,
    sands: Sequence[CalibratedSand] = (),
) -> str:  # fmt: skip
    """Draw a measure over the two swept keys as contours, with the runs and the iso-lines.

    The second key goes along x, as in Figure 12 of the paper. ``points``: (n, 2) float64, values of
    the keys of the runs; ``sands``: whose lines of this measure are drawn with their bands.
    """
    figure = Figure(figsize=(7.6, 5.2), dpi=110, layout="constrained")
    ax = figure.add_subplot()
    first, second = axes_of(emulator)
    x, y = plotted(keys[1], second), plotted(keys[0], first)
    mean, _ = surface(emulator)
    filled = ax.contourf(x, y, mean, levels=12, cmap="cividis", alpha=0.85)
    lines = ax.contour(x, y, mean, levels=filled.levels, colors="white", linewidths=0.6)
    ax.clabel(lines, fmt="%g", fontsize=8)
    figure.colorbar(filled, ax=ax, label=title)
    ax.plot(plotted(keys[1], points[:, 1]), plotted(keys[0], points[:, 0]), "k.", ms=4)
    for place, sand in enumerate(sands):
        line = sand.lines.get(emulator.measure)
        if line is None or np.isnan(line.first).all():
            continue
        colour = _BANDS[place % len(_BANDS)]
        x_line = plotted(keys[1], line.second)
        ax.fill_between(x_line, plotted(keys[0], line.low), plotted(keys[0], line.high),
                        color=colour, alpha=0.35, lw=0)  # fmt: skip
        value = sand.sand.targets[emulator.measure].value
        ax.plot(x_line, plotted(keys[0], line.first), color=colour, lw=2.2,
                label=f"{sand.sand.name.replace('_', ' ')}: {value:g}")  # fmt: skip
    if ax.get_legend_handles_labels()[0]:
        ax.legend(loc="upper right", fontsize=9)
    ax.set_xlabel(axis_title(keys[1]))
    ax.set_ylabel(axis_title(keys[0]))
    return png(figure)


def draw_posterior(sand: CalibratedSand, keys: tuple[str, str]) -> str:
    """Draw what all targets together leave probable, and what the first alone leaves."""
    assert sand.posterior is not None
    assert sand.by_first is not None
    figure = Figure(figsize=(5.6, 4.6), dpi=110, layout="constrained")
    ax = figure.add_subplot()
    share = sand.posterior.share
    x, y = plotted(keys[1], sand.posterior.second), plotted(keys[0], sand.posterior.first)
    ax.contourf(x, y, share / share.max(), levels=np.linspace(0.02, 1.0, 12), cmap="Blues")
    more = len(sand.sand.targets) + len(sand.sand.assumed) > 1
    first = [(sand.by_first, "0.45", "first value alone")] if more else []
    for posterior, colour, label in (*first, (sand.posterior, "#0b5cad", "all that is known")):
        ax.contour(x, y, posterior.region().astype(float), levels=[0.5], colors=colour)
        ax.plot([], [], color=colour, label=f"95 %, {label}")
    mode = sand.posterior.mode
    ax.plot(plotted(keys[1], np.array(mode[1])), plotted(keys[0], np.array(mode[0])), "x",
            color=_LINE, ms=9, mew=2.5, label="most probable")  # fmt: skip
    ax.set_xlabel(axis_title(keys[1]))
    ax.set_ylabel(axis_title(keys[0]))
    ax.legend(fontsize=9)
    return png(figure)


PICTURED_HEAPS = 3


def steepest_heaps(
    study_folder: Path, summary: pd.DataFrame, verdict: Verdict, scenario: Scenario
) -> tuple[ReportPicture, ...]:
    """Draw runs with the least, the middle and the steepest slope; none without a level gate."""
    if scenario.gate is None or not scenario.gate.is_level:
        return ()
    values = usable_values(summary, verdict.measure).dropna().sort_values()
    places = evenly(len(values), PICTURED_HEAPS).tolist()
    heaps = []
    for index in [values.index[i] for i in places] if len(values) else []:
        run = str(summary.loc[index, RUN])
        moments = list_moments(study_folder / "runs" / run)
        if not moments:
            continue
        sand = moments[-1].load()
        heading = f"{number(values[index])}°: {run}"
        picture = draw_heap(sand, scenario, 1.02 * scenario.scene.top_m)
        alt = f"Heap and hopper of run {run} with fitted lines"
        heaps.append(ReportPicture(picture, alt, heading))
    return tuple(heaps)
