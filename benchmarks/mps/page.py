"""The page on metal flow and its picture."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import matplotlib
from matplotlib.figure import Figure
from matplotlib.lines import Line2D

from benchmarks.frame import render

matplotlib.use("Agg")
RECOMMENDED = "MR10-0.5"
"""One of the two cheapest among the calm settings of ``tank_map``."""
Row = Mapping[str, Any]


def page(results: Mapping[str, Any]) -> str:
    """Write the page.

    Parameters
    ----------
    results : mapping
        What ``benchmarks.mps`` measured.
    """
    schemes = results["schemes"]
    runs = [row for row in [*schemes["again"], *schemes["rows"]] if row["scheme"] == RECOMMENDED]
    return render(Path(__file__).with_name("page.md.j2"), {
        **results,
        "recommended": RECOMMENDED,
        "comparisons": comparisons(schemes["rows"]),
        "costs_s": sorted(schemes["duration_s"] * row["cpu_s_per_simulated_s"] for row in runs),
        "shares": [row["pressure_share"] for row in schemes["rows"] if not row["stopped"]],
        "casting": results["large"]["row"],
        "origins": {name: part for name, part in results.items() if "solver" in part},
    })  # fmt: skip


def comparisons(rows: Sequence[Row]) -> list[dict[str, Any]]:
    """Say of each scheme with several relaxations whether a single solve is as calm for its cost.

    Parameters
    ----------
    rows : sequence of mapping
        Of the part ``schemes``; those that a guard stopped do not compete.

    Returns
    -------
    list of dict
        ``several``, ``single``, the calmest single solve at no more cost or None, and
        ``is_worth``; empty where no scheme of one kind ran to its end.
    """
    finished = [row for row in rows if not row["stopped"]]
    singles = [row for row in finished if row["relaxations"] == 1]
    compared = []
    for row in finished if singles else ():
        if row["relaxations"] == 1:
            continue
        cost = row["cpu_s_per_simulated_s"]
        rivals = [rival for rival in singles if rival["cpu_s_per_simulated_s"] <= cost]
        single = min(rivals, key=lambda rival: rival["pressure_noise_pa"], default=None)
        is_worth = single is None or single["pressure_noise_pa"] > row["pressure_noise_pa"]
        compared.append({"several": row, "single": single, "is_worth": is_worth})
    return compared


def draw(results: Mapping[str, Any], folder: Path) -> None:
    """Pressure noise and residual speed against cost, one numbered point a scheme."""
    rows = [
        row for part in ("schemes", "peers") for row in results[part]["rows"] if not row["stopped"]
    ]
    figure = Figure(figsize=(11, 4.5), layout="constrained")
    axes = figure.subplots(1, 2)
    for axis, key, label in (
        (axes[0], "pressure_noise_pa", "standard deviation of pressure at 70 mm, Pa"),
        (axes[1], "mean_speed_m_s", "mean speed of metal at rest, m/s"),
    ):
        for place, row in enumerate(rows, 1):
            colour = "C2" if "version" in row else "C0" if row["source"] == "density" else "C1"
            at = (row["cpu_s_per_simulated_s"], row[key])
            axis.plot(*at, "o", ms=4, color=colour)
            axis.annotate(
                f"{place}", at, xytext=(4, 2), textcoords="offset points",
                fontsize=8, color=colour,
            )  # fmt: skip
        axis.margins(0.1)
        axis.set(xscale="log", yscale="log", ylabel=label)
        axis.set_xlabel("processor time for a simulated second, s")
    names = [f"{place}  {row['scheme']}" for place, row in enumerate(rows, 1)]
    handles = [Line2D([], [], ls="", label=name) for name in names]
    figure.legend(handles=handles, loc="outside right upper", fontsize=8, handlelength=0)
    figure.savefig(folder / "metal_flow.png", dpi=120)
