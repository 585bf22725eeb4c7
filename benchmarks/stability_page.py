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

from benchmarks.stability_runs import BLOWS_UP, DRIFTS, STABLE
from benchmarks.tables import table
from sandmould import ROOT

FIGURE = ROOT / "docs" / "stability.png"
PAGE = ROOT / "docs" / "stability.md"
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


def draw(results: dict[str, Any], path: Path) -> None:
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
    figure.savefig(path, dpi=110, metadata={"Software": None})
    plt.close(figure)


def _limits_table(results: dict[str, Any]) -> str:
    engines = list(results["engines"])
    rows = []
    for name, scene in results["scenes"].items():
        for i, limits in enumerate(scene["limits"]):
            zeta, exact = limits["damping_ratio"], limits["whole_s"] / scene["critical_s"]
            measured = [
                f"{row['largest_stable_over_critical']:.3f} ± {row['known_within']:.3f}"
                for row in (scene["maps"][engine][i] for engine in engines)
            ]
            rows.append([
                TITLES[name].format(grains=scene["grains"]),
                f"{zeta:g}",
                f"{of_one_mode(zeta):.3f}",
                f"{exact:.3f}",
                *measured,
            ])  # fmt: skip
    titles = [ENGINE_TITLES[engine] for engine in engines]
    head = ["scene", "ζ", "(42), ξ = ζ", "(42), whole system", *titles]
    return table(head, rows)


def _estimates_table(results: dict[str, Any]) -> str:
    rows = []
    bed = results["scenes"]["bed"]
    for limits, one_s in zip(bed["limits"], results["bed_one_contact_s"], strict=True):
        whole = limits["whole_s"]
        steps = [one_s, *(limits[f"{k}_s"] for k in ("simplified", "grain", "planned"))]
        rows.append([
            f"{limits['damping_ratio']:g}",
            f"{1e6 * whole:.1f}",
            *(f"{1e6 * s:.1f} ({s / whole:.2f})" for s in steps),
        ])  # fmt: skip
    head = [
        "ζ",
        "whole system, µs",
        "one contact, (51) and (54), µs",
        "its own contacts on one line, µs",
        "its own eigenproblem, (43)-(47), µs",
        "planned, 6 contacts, µs",
    ]
    return table(head, rows)


def _rolling_table(results: dict[str, Any]) -> str:
    rows = [
        [
            f"{row['inertia']}, I = {0.5 if row['inertia'] == 'disc' else 0.4:g} m r²",
            f"{row['physical_m_s2']:.4f} ({row['exact_physical_m_s2']:.4f})",
            f"{row['scaled_m_s2']:.4f}",
            f"{row['factor']:.4f} ({row['exact_factor']:.4f})",
        ]
        for row in results["rotation"]["rolling"]
    ]
    head = ["grain", "as it is, m/s² (exact)", "scaled, m/s²", "factor (exact)"]
    return table(head, rows)


def _gain_table(results: dict[str, Any]) -> str:
    physical, scaled = results["scenes"]["bed"]["limits"], results["rotation"]["bed_scaled"]
    rows = []
    for a, b in zip(physical, scaled, strict=True):
        steps = ((a[k], b[k]) for k in ("whole_s", "planned_s"))
        gains = (f"{1e6 * x:.1f} → {1e6 * y:.1f} ({y / x:.2f})" for x, y in steps)
        rows.append([f"{a['damping_ratio']:g}", *gains])
    return table(["ζ", "whole system, µs", "planned, µs"], rows)


def _first_blow_up(results: dict[str, Any], scene: str) -> str:
    """Smallest step that blew up over the exact limit, over all engines and damping ratios."""
    found = results["scenes"][scene]
    ratios = [
        x / (limits["whole_s"] / found["critical_s"])
        for rows in found["maps"].values()
        for limits, row in zip(found["limits"], rows, strict=True)
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


def _followed_table(results: dict[str, Any]) -> str:
    engines = list(results["engines"])
    rows = []
    for row in results["bed_followed"]:
        seen = [
            f"{1e3 * row[e]['rms_speed_m_s']:.3g} mm/s, {100 * row[e]['rise']:+.2f} %"
            if "rise" in row[e]
            else f"stopped: {row[e]['outcome']}"
            for e in engines
        ]
        rows.append([f"{row['damping_ratio']:g}", f"{row['step_over_limit']:g}", *seen])
    titles = [ENGINE_TITLES[engine] for engine in engines]
    return table(["ζ", "step over the limit", *titles], rows)


def _agreement(results: dict[str, Any]) -> str:
    """How many of the outcomes are the same on all engines."""
    same = [
        len({row["outcomes"][k] for row in rows}) == 1
        for scene in results["scenes"].values()
        for rows in zip(*scene["maps"].values(), strict=True)
        for k in range(len(results["steps_over_critical"]))
    ]
    return f"{sum(same)} of {len(same)}"


def write(results: dict[str, Any], path: Path) -> None:
    """Write the page with its tables."""
    template = Path(__file__).with_name("stability_page.md").read_text(encoding="utf-8")
    bed = results["scenes"]["bed"]
    factors = [
        one / row["whole_s"]
        for one, row in zip(results["bed_one_contact_s"], bed["limits"], strict=True)
    ]
    planned = [row["planned_s"] / row["whole_s"] for row in bed["limits"]]
    words = {
        "engines": ", ".join(f"{ENGINE_TITLES[k]} ({v})" for k, v in results["engines"].items()),
        "limits_table": _limits_table(results),
        "estimates_table": _estimates_table(results),
        "rolling_table": _rolling_table(results),
        "gain_table": _gain_table(results),
        "largest_error_percent": f"{100 * _largest_error(results):.2f}",
        "agreement": _agreement(results),
        "blow_contact": _first_blow_up(results, "contact"),
        "blow_column": _first_blow_up(results, "column"),
        "blow_bed": _first_blow_up(results, "bed"),
        "one_contact": f"{min(factors):.1f} to {max(factors):.1f}",
        "planned": f"{min(planned):.2f} to {max(planned):.2f}",
        "planned_half": f"{min(planned) / 2:.2f} to {max(planned) / 2:.2f}",
        "followed_table": _followed_table(results),
        "grain": f"{max(r['grain_s'] / r['whole_s'] for r in bed['limits']):.2f}",
        "grain_undamped": f"{bed['limits'][0]['grain_s'] / bed['limits'][0]['whole_s']:.2f}",
    }
    for name, text in words.items():
        # The template ends the line of a placeholder itself.
        template = template.replace(f"@{name}@", text.rstrip("\n"))
    path.write_text(template, encoding="utf-8")
