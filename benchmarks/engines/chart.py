"""The picture of docs/developers/speed.md."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import matplotlib
import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.ticker import LogLocator, NullFormatter, StrMethodFormatter

from benchmarks.engines.scale import SCALE_TARGET

matplotlib.use("Agg")
# Okabe and Ito's colours, which the colour-blind can tell apart; markers tell them apart too.
ENGINES = {
    "reference": ("#0072B2", "o"),
    "lammps": ("#D55E00", "s"),
    "liggghts": ("#009E73", "^"),
}
_PART_COLOURS = (
    "#999999", "#56B4E9", "#0072B2", "#E69F00", "#009E73", "#CC79A7", "#FFFFFF", "#F0E442",
    "#D55E00",
)  # fmt: skip
_LIMITS = {
    "bandwidth": "v", "vector arithmetic": "s", "scalar arithmetic": "D", "quotients and roots": "X"
}  # fmt: skip


def _bars(spreads: list[dict[str, float]]) -> tuple[np.ndarray, np.ndarray]:
    """Medians, and how far the range goes below and above them."""
    median, least, most = (
        np.array([spread[key] for spread in spreads]) for key in ("median", "least", "most")
    )
    return median, np.array([median - least, most - median])


def _rates(ax: Axes, rows: list[dict[str, Any]]) -> None:
    for k, (name, (colour, _)) in enumerate(ENGINES.items()):
        here = [i for i, row in enumerate(rows) if name in row["engines"]]
        spreads = [rows[i]["engines"][name]["grain_steps_per_s"] for i in here]
        if not here:
            continue
        median, error = _bars(spreads)
        x = np.array(here) + 0.27 * (k - 1)
        ax.bar(x, median / 1e6, 0.25, color=colour, label=name, yerr=error / 1e6, capsize=2)
        for i, place, height in zip(here, x, (median + error[1]) / 1e6, strict=True):
            if name in rows[i]["reference_over"]:
                times = rows[i]["reference_over"][name]["median"]
                ax.annotate(f"1/{times:.1f}", (place, height), (0, 2), textcoords="offset points",
                            ha="center", fontsize=8)  # fmt: skip
    ax.set_xticks(range(len(rows)), [row["bed"].replace(", ", "\n") for row in rows], fontsize=8)
    ax.set_ylabel("million grain-steps per second")
    ax.set_title("One core, the same bed; 1/x: the reference is x times as fast")
    ax.legend(frameon=False)


def _sizes(ax: Axes, scale: dict[str, Any]) -> None:
    styles = (("2", "discs", "#0072B2", "o"), ("3", "spheres", "#D55E00", "s"))
    for dimension, label, colour, marker in styles:
        row = scale[dimension]
        median, error = _bars(row["ns_per_grain_step"])
        ax.errorbar(
            row["sizes"], median, error, color=colour, marker=marker, capsize=2, label=label
        )
        ax.axhspan(median.min(), SCALE_TARGET * median.min(), color=colour, alpha=0.12, lw=0)
    ax.set_xscale("log")
    ax.xaxis.set_minor_formatter(NullFormatter())
    ax.set_ylim(0)
    ax.set_xlabel("grains")
    ax.set_ylabel("ns per grain-step")
    ax.set_title(f"Reference, one core, over scene size; bands: {SCALE_TARGET:g} times the least")
    ax.legend(frameon=False)


def _parts_of(bed: dict[str, Any]) -> dict[str, float]:
    """Medians of all parts of a step, ns."""
    parts = {k: v["median"] for k, v in bed["within_pairs"].items()}
    return parts | {k: v["median"] for k, v in bed["parts"].items() if k != "pairs"}


def _limits(ax: Axes, beds: list[dict[str, Any]]) -> None:
    y = np.arange(len(beds))[::-1]
    left = np.zeros(len(beds))
    parts_of_beds = [_parts_of(bed) for bed in beds]
    for name, colour in zip(parts_of_beds[0], _PART_COLOURS, strict=False):
        width = np.maximum(0.0, [parts[name] for parts in parts_of_beds])
        ax.barh(y, width, 0.4, left, color=colour, edgecolor="black", lw=0.4, label=name)
        left += width
    whole = [bed["ns_per_grain_step"]["median"] for bed in beds]
    ax.plot(whole, y + 0.3, "|", color="black", ms=10, mew=2, label="whole step")
    for name, marker in _LIMITS.items():
        x = [bed["bounds_ns"][name] for bed in beds]
        ax.plot(x, y - 0.32, marker, color="black", ms=6, label=f"limit: {name}")
    ax.set_yticks(y, [bed["bed"] for bed in beds])
    ax.set_ylim(-0.6, len(beds) - 0.5)
    ax.set_xlim(0, 1.05 * max(*left, *whole))
    ax.set_xlabel("ns per grain-step")
    ax.set_title("Where a step of the reference goes, and its limits")
    ax.legend(frameon=False, fontsize=7, ncols=4, loc="upper center", bbox_to_anchor=(0.5, -0.14))


def _accuracy(ax: Axes, rows: list[dict[str, Any]]) -> None:
    for name, (colour, marker) in ENGINES.items():
        for dashpot, dash, filled in (("corrected", "-", colour), ("plain", ":", "none")):
            mine = [row for row in rows if (row["engine"], row["dashpot"]) == (name, dashpot)]
            if not mine:
                continue
            x, y = [row["wall_s_per_s"] for row in mine], [100 * row["error"] for row in mine]
            ax.plot(x, y, color=colour, marker=marker, ls=dash, mfc=filled,
                    label=f"{name}, {dashpot} dashpots")  # fmt: skip
            for row, place in zip(mine, zip(x, y, strict=True), strict=True):
                below = dashpot == "corrected"
                ax.annotate(f"{row['fraction']:g}", place, (-4, -9) if below else (4, 4),
                            textcoords="offset points", fontsize=7, color=colour)  # fmt: skip
    ax.set_xscale("log")
    ax.set_yscale("log")
    for axis, unit in ((ax.xaxis, ""), (ax.yaxis, " %")):
        axis.set_major_locator(LogLocator(subs=(1, 2, 5)))
        axis.set_major_formatter(StrMethodFormatter("{x:g}" + unit))
        axis.set_minor_formatter(NullFormatter())
    ax.set_xlabel("wall time of one simulated second of the smaller bed of discs, s")
    ax.set_ylabel("relative error of the restitution")
    ax.set_title("Accuracy against cost; numbers: time step over the critical one")
    ax.legend(frameon=False, fontsize=8)


def draw(results: dict[str, Any], path: Path) -> None:
    """Draw rates, sizes, limits and accuracy."""
    figure = Figure(figsize=(13, 10.5), layout="constrained")
    axes = figure.subplots(2, 2)
    _rates(axes[0, 0], results["rates"])
    _sizes(axes[0, 1], results["scale"])
    _limits(axes[1, 0], [bed for bed in results["roofline"]["beds"] if "parts" in bed])
    _accuracy(axes[1, 1], results["accuracy"])
    for ax in axes.flat:
        ax.spines[["top", "right"]].set_visible(False)
    figure.savefig(path, dpi=110)
