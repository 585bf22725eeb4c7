"""The picture and the page of the stability map."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import matplotlib

matplotlib.use("Agg")
import matplotlib.pyplot as plt
import numpy as np
from matplotlib.axes import Axes
from matplotlib.colors import ListedColormap
from matplotlib.lines import Line2D
from matplotlib.patches import Patch

from benchmarks.frame import render
from benchmarks.stability.runs import BLOWS_UP, DRIFTS, STABLE

OUTCOMES = (STABLE, DRIFTS, BLOWS_UP)
COLOURS = ("#a6d4ee", "#f0b429", "#b5401c")
"""Apart in lightness too, so that they differ without colour."""
TITLES = {
    "contact": "one grain on the floor",
    "column": "column of {grains} grains",
    "bed": "settled bed of {grains} discs",
}
ENGINE_TITLES = {"reference": "reference", "lammps": "LAMMPS", "liggghts": "LIGGGHTS"}
_LABELS = {
    "without": "(41), no damping: $2/\\omega_{max}$",
    "one": "(42) with $\\xi=\\zeta$",
    "whole": "(42) for the whole system, computed from its contacts",
    "planned": "planned step of a study (fraction 1)",
    "measured": "largest stable step, measured",
}
_LINES: dict[str, dict[str, Any]] = {
    "without": {"color": "black", "lw": 1.2, "ls": ":"},
    "one": {"color": "black", "lw": 1.4, "ls": (0, (5, 2))},
    "whole": {"color": "black", "lw": 2.2},
    "planned": {"color": "#1b5e20", "lw": 1.8, "ls": (0, (6, 2, 1, 2))},
    "measured": {"color": "black", "marker": "o", "mfc": "white", "ms": 6, "ls": "none"},
}


def of_one_mode(damping_ratio: Any) -> Any:
    """Eq. (42) over eq. (41)."""
    return np.sqrt(1 + np.square(damping_ratio)) - damping_ratio


def _edges(centres: list[float], low: float, high: float) -> np.ndarray:
    middle = (np.array(centres[1:]) + centres[:-1]) / 2
    return np.concatenate([[low], middle, [high]])


def _panel(axes: Axes, results: dict[str, Any], scene: dict[str, Any], engine: str) -> None:
    rows = scene["maps"][engine]
    zeta = [row["damping_ratio"] for row in rows]
    codes = np.array([[OUTCOMES.index(o) for o in row["outcomes"]] for row in rows])
    axes.pcolormesh(
        _edges(results["steps_over_critical"], 0.0, 2.2),
        _edges(zeta, -0.06, 1.06),
        codes,
        cmap=ListedColormap(COLOURS),
        vmin=-0.5,
        vmax=2.5,
        edgecolors="white",
        linewidth=0.4,
    )
    critical_s = scene["critical_s"]
    fine = np.linspace(0, 1, 101)
    axes.axvline(1.0, **_LINES["without"])
    axes.plot(of_one_mode(fine), fine, **_LINES["one"])
    for name in ("whole", "planned"):
        steps = [row[f"{name}_s"] / critical_s for row in scene["limits"]]
        axes.plot(steps, zeta, **_LINES[name])
    axes.plot([row["largest_stable_over_critical"] for row in rows], zeta, **_LINES["measured"])
    axes.set_xlim(0, 2.2)
    axes.set_ylim(-0.06, 1.06)
    axes.set_xticks([0, 0.5, 1, 1.5, 2])
    axes.set_yticks([0, 0.25, 0.5, 0.75, 1])


def draw(results: dict[str, Any], folder: Path) -> None:
    """Draw one panel for each scene and engine."""
    scenes, engines = results["scenes"], list(results["engines"])
    plt.rcParams.update({"font.size": 10, "axes.titlesize": 11, "mathtext.fontset": "dejavusans"})
    figure, panels = plt.subplots(
        len(scenes), len(engines), figsize=(3.6 * len(engines) + 0.6, 9.6),
        sharex=True, sharey=True, squeeze=False,
    )  # fmt: skip
    for i, (name, scene) in enumerate(scenes.items()):
        for j, engine in enumerate(engines):
            _panel(panels[i, j], results, scene, engine)
            if i == 0:
                panels[i, j].set_title(ENGINE_TITLES[engine], fontweight="bold")
        title = TITLES[name].format(grains=scene["grains"])
        panels[i, 0].set_ylabel(f"{title}\n\ndamping ratio $\\zeta$ (1)")
    for axes in panels[-1]:
        axes.set_xlabel("time step over that of (41) (1)")
    handles: list[Any] = [
        Patch(facecolor=c, edgecolor="grey", label=o)
        for c, o in zip(COLOURS, OUTCOMES, strict=True)
    ]
    handles += [Line2D([], [], label=_LABELS[name], **style) for name, style in _LINES.items()]
    figure.legend(handles=handles, loc="lower center", ncols=3, frameon=False, handlelength=2.8)
    figure.tight_layout(rect=(0, 0.09, 1, 1), h_pad=1.2, w_pad=1.0)
    figure.savefig(folder / "stability.png", dpi=110, metadata={"Software": None})
    plt.close(figure)


def _first_blow_up(results: dict[str, Any], scene: str) -> str:
    """Smallest step that blew up over the exact limit, over all engines and damping ratios."""
    of_scene = results["scenes"][scene]
    ratios = [
        x / (limits["whole_s"] / of_scene["critical_s"])
        for rows in of_scene["maps"].values()
        for limits, row in zip(of_scene["limits"], rows, strict=True)
        for x, outcome in zip(results["steps_over_critical"], row["outcomes"], strict=True)
        if outcome == BLOWS_UP
    ]
    return f"{min(ratios):.2f}" if ratios else "none"


def _largest_error(results: dict[str, Any]) -> float:
    """Largest deviation of a measured limit from the exact one, relative."""
    return max(
        abs(row["largest_stable_over_critical"] * scene["critical_s"] / limits["whole_s"] - 1)
        for scene in results["scenes"].values()
        for rows in scene["maps"].values()
        for limits, row in zip(scene["limits"], rows, strict=True)
    )


def _agreement(results: dict[str, Any]) -> list[bool]:
    """Whether an outcome is the same on all engines, point by point."""
    return [
        len({row["outcomes"][k] for row in rows}) == 1
        for scene in results["scenes"].values()
        for rows in zip(*scene["maps"].values(), strict=True)
        for k in range(len(results["steps_over_critical"]))
    ]


def page(results: dict[str, Any]) -> str:
    """Write the page.

    Parameters
    ----------
    results : dict
        What ``benchmarks.stability`` measured.
    """
    scenes = {
        name: scene | {"title": TITLES[name].format(grains=scene["grains"])}
        for name, scene in results["scenes"].items()
    }
    limits = scenes["bed"]["limits"]
    return render(Path(__file__).with_name("page.md.j2"), {
        **results,
        "scenes": scenes,
        "titles": ENGINE_TITLES,
        "of_one_mode": of_one_mode,
        "largest_error": _largest_error(results),
        "agreement": _agreement(results),
        "known_within": max(
            row["known_within"]
            for scene in scenes.values()
            for rows in scene["maps"].values()
            for row in rows
        ),
        "blow_up": {scene: _first_blow_up(results, scene) for scene in scenes},
        "one_contact": [
            step_s / row["whole_s"]
            for step_s, row in zip(results["bed_one_contact_s"], limits, strict=True)
        ],
        "planned": [row["planned_s"] / row["whole_s"] for row in limits],
        "grain": [row["grain_s"] / row["whole_s"] for row in limits],
    })  # fmt: skip


def longer_steps(results: dict[str, Any]) -> str:
    """Write the page on what makes a step longer.

    Parameters
    ----------
    results : dict
        What ``benchmarks.stability`` measured.
    """
    return render(Path(__file__).with_name("longer_steps.md.j2"), results)
