"""The stability map: which settings hold, over time step and relaxations, as the paper's figure 6.

Beside it, what the text of Hirata and Anzai (2017) says of its own conditions, and the pressure
at the probes of each run.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from numpy.typing import NDArray

from sandmould.casting.mps.stability_measures import COUNTS, SHARES, STEPS_S, StabilityRating
from sandmould.drawing.chart import Chart, Line, tints
from sandmould.drawing.figures import png
from sandmould.runs.columns import CLASSIFICATION, TIME_S
from sandmould.runs.formatting import setting_text

AXES = ("dt_max_s", "relaxations")
SHARE = "source_share"
MOST_ACROSS = 4
"""Panels in a row."""
SIGNS = {
    StabilityRating.EXCELLENT: ("o", "#009E73"), StabilityRating.BIASED: ("s", "#56B4E9"),
    StabilityRating.GOOD: ("D", "#E69F00"),
    StabilityRating.FAILED: ("x", "#D55E00"),
}  # fmt: skip
"""The paper's signs, and colours that anyone can tell apart."""


def stability_map(summary: pd.DataFrame, keys: Sequence[str]) -> str:
    """Draw the map of runs that ended, a panel for each c_poi and each value of what else is swept.

    A ``data:`` address; empty unless time step and relaxations are swept.
    """
    if not set(AXES) <= set(keys) or summary.empty:
        return ""
    others = [key for key in keys if key not in AXES]
    parts = _parts(summary, others)
    across = min(len(parts), MOST_ACROSS)
    rows = -(-len(parts) // across)
    figure = Figure(figsize=(max(5.0, 2.9 * across), 0.6 + 2.8 * rows), dpi=110,
                    layout="constrained")  # fmt: skip
    grid = figure.subplots(rows, across, sharex=True, sharey=True, squeeze=False)
    steps, counts = sorted(summary[AXES[0]].unique()), sorted(summary[AXES[1]].unique())
    for axes in grid.flat[len(parts) :]:
        axes.set_axis_off()
    for axes, (title, part) in zip(grid.flat, parts, strict=False):
        for verdict, (marker, colour) in SIGNS.items():
            own = part[part[CLASSIFICATION] == verdict.value]
            # evenly spaced, as the paper's: the values rise by doubling
            axes.plot(
                [counts.index(n) for n in own[AXES[1]]], [steps.index(dt) for dt in own[AXES[0]]],
                marker, color=colour, ms=10, mew=2.2,
                mfc="none" if verdict is not StabilityRating.GOOD else colour,
            )  # fmt: skip
        axes.set_xticks(range(len(counts)), [f"{n}" for n in counts])
        axes.set_yticks(range(len(steps)), [f"{1e3 * dt:g}" for dt in steps])
        axes.set(xlim=(-0.5, len(counts) - 0.5), ylim=(-0.5, len(steps) - 0.5))
        axes.set_xlabel("relaxations")
        axes.set_title(title, fontsize=9)
        axes.grid(alpha=0.3)
    for axes in grid[:, 0]:
        axes.set_ylabel("largest time step, ms")
    signs = [
        Line2D([], [], ls="", marker=marker, color=colour, mew=2.0, label=verdict.value,
               mfc="none" if verdict is not StabilityRating.GOOD else colour)
        for verdict, (marker, colour) in SIGNS.items()
    ]  # fmt: skip
    figure.legend(handles=signs, loc="outside lower center", ncols=4, frameon=False)
    return png(figure)


def _parts(summary: pd.DataFrame, others: Sequence[str]) -> list[tuple[str, pd.DataFrame]]:
    """Title and runs of each panel, great values first."""
    if not others:
        return [("", summary)]
    values = summary[list(others)].drop_duplicates().sort_values(list(others), ascending=False)
    parts = []
    for _, panel in values.iterrows():
        title = setting_text({key: panel[key] for key in others}).replace(", ", "\n")
        parts.append((title, summary[(summary[list(others)] == panel).all(axis=1)]))
    return parts


def condition_text(values: Mapping[str, Any]) -> str:
    """A setting as the paper names it, ``MR5-0.5``, with its largest step; the rest in full."""
    if not {*AXES, SHARE} <= set(values):
        return setting_text(values)
    dt_ms = 1e3 * float(values[AXES[0]])
    papers = f"MR{values[AXES[1]]}-{float(values[SHARE]):.3g}, {dt_ms:g} ms"
    rest = {key: value for key, value in values.items() if key not in (*AXES, SHARE)}
    return ", ".join((papers, setting_text(rest))) if rest else papers


def said_of(values: Mapping[str, Any]) -> str:
    """What the paper's text says of a condition of its table 2; empty for any other.

    Its figures 3 and 4: the deviation at 70 mm is below 200 Pa and the field hydrostatic in all
    but MR1-1.0 and MR2-1.0; of MR1-0.5 figure 5(d) shows a noise that is not reduced enough.
    """
    try:
        dt_s, share = float(values[AXES[0]]), float(values[SHARE])
        count = int(values[AXES[1]])
    except (KeyError, TypeError, ValueError):
        return ""
    if share not in SHARES or (dt_s, count) not in zip(STEPS_S, COUNTS, strict=True):
        return ""
    if share == 1.0 and count in (1, 2):
        return "noisy, above 200 Pa"
    if (count, share) == (1, 0.5):
        return "below 200 Pa, yet not reduced enough"
    return "hydrostatic, below 200 Pa"


BINS = 300
"""Of a history; of the steps in each its lowest and its highest value are drawn."""
HIGHEST = 3.0
"""Peaks above so many times the largest hydrostatic pressure are cut off."""


def pressure_history(
    folder: Path, setting: str, rating: str, ideal_pa: Mapping[str, float]
) -> Chart:
    """Draw the pressure at each probe of a run, with its hydrostatic value, by probe in Pa.

    ``setting``, ``rating``: what is swept, and how stable the run is.
    """
    table = pd.read_csv(folder / "series.tsv", sep="\t")
    time_s = table[TIME_S].to_numpy(dtype=np.float64)
    top_pa = HIGHEST * max(ideal_pa.values())
    lines = []
    for (name, ideal), tint in zip(ideal_pa.items(), tints(len(ideal_pa), False), strict=True):
        pressure_pa = np.minimum(table[f"{name}_pa"].to_numpy(dtype=np.float64), top_pa)
        level = np.array([[time_s[0], ideal], [time_s[-1], ideal]])
        lines += [
            Line(extremes(time_s, pressure_pa), tint, "run", name, f"pressure at {name}"),
            Line(level, tint, "joined", title=f"hydrostatic at {name}: {ideal:.0f} Pa"),
        ]
    alt = f"Pressure at {', '.join(ideal_pa)} against time at {setting}: {rating}."
    return Chart("time, s", "pressure, Pa", alt, tuple(lines))


def extremes(x: NDArray[np.float64], y: NDArray[np.float64]) -> NDArray[np.float64]:
    """The lowest and the highest point of each part of a curve, in their order.

    (k, 2) float64: all points where there are at most two a part; NaN is passed over.
    """
    points = np.column_stack([x, y])[np.isfinite(y)]
    if len(points) <= 2 * BINS:
        return points
    chosen = {
        place
        for part in np.array_split(np.arange(len(points)), BINS)
        for place in (part[points[part, 1].argmin()], part[points[part, 1].argmax()])
    }
    drawn: NDArray[np.float64] = points[sorted(chosen)]
    return drawn
