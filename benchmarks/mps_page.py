"""The page on metal flow and its picture."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path
from string import Template
from typing import Any

import matplotlib
from matplotlib.figure import Figure
from matplotlib.lines import Line2D

from benchmarks.tables import number, table

matplotlib.use("Agg")
WORDS = Path(__file__).with_name("mps_page.md")
RECOMMENDED = "MR10-0.5"
"""One of the two cheapest among the calm settings of ``tank_map``."""
Row = Mapping[str, Any]


def write(kept: Mapping[str, Any], folder: Path) -> None:
    """Write page and picture.

    Parameters
    ----------
    kept : mapping
        What ``mps.json`` holds.
    folder : Path
    """
    rows, peers = kept["schemes"]["rows"], kept["peers"]["rows"]
    ran = [row for row in rows if not row["stopped"]]
    _draw([*ran, *(row for row in peers if not row["stopped"])], folder / "metal_flow.png")
    origin = "; ".join(
        f"{name}: commit {part['commit']}, solver {part['solver']}, {part['machine']['processor']}"
        for name, part in kept.items()
    )
    text = Template(WORDS.read_text(encoding="utf-8")).substitute(
        duration=f"{kept['schemes']['duration_s']:g}",
        verdict=verdict(rows),
        schemes_table=_schemes_table(rows),
        cost=_cost_words(kept["schemes"]),
        share=_share_words(ran),
        solvers=_solvers_table(kept["solvers"]["rows"]),
        large=_large_words(kept["large"]["row"]),
        peers=_peers_words(peers, kept["peers"]["own"], kept["peers"]["duration_s"]),
        origin=f"{origin}.",
    )
    (folder / "metal_flow.md").write_text(text, encoding="utf-8")


def verdict(rows: Sequence[Row]) -> str:
    """Say whether a single solve a step is as calm as several at no more cost.

    Parameters
    ----------
    rows : sequence of mapping
        Of the part ``schemes``; those that a guard stopped do not compete.
    """
    ran = [row for row in rows if not row["stopped"]]
    several = [row for row in ran if row["relaxations"] > 1]
    single = [row for row in ran if row["relaxations"] == 1]
    if not several or not single:
        return "Not answered: no scheme of one kind ran to its end."
    lines = []
    for row in several:
        rivals = [one for one in single if _cost(one) <= _cost(row)]
        calmer = [one for one in rivals if one["pressure_noise_pa"] <= row["pressure_noise_pa"]]
        best = min(calmer or rivals, key=lambda one: one["pressure_noise_pa"], default=None)
        beside = f"{_told(best)}" if best else "none"
        lines.append((_told(row), beside, "no" if calmer else "yes"))
    worth = sum(line[2] == "yes" for line in lines)
    said = (f"**{worth} of {len(lines)} settings with multiple relaxation have less pressure noise "
            "than every single solve a step of no more cost.**")  # fmt: skip
    head = ("several relaxations", "calmest single solve at no more cost", "worth it")
    return f"{said}\n\n{table(head, lines)}".rstrip()


def _cost(row: Row) -> float:
    return float(row["cpu_s_per_simulated_s"])


def _told(row: Row) -> str:
    return f"{row['scheme']}: {_cost(row):.2g} s, {row['pressure_noise_pa']:.3g} Pa"


def _schemes_table(rows: Sequence[Row]) -> str:
    head = ("scheme", "verdict of figure 6", "processor s a simulated s", "noise, Pa",
            "mean over rho g h", "mean speed, m/s", "fastest, m/s",
            "iterations a solve")  # fmt: skip
    lines = []
    for row in rows:
        if row["stopped"]:
            lines.append((row["scheme"], row["verdict"], row["stopped"], *[""] * 5))
            continue
        lines.append((
            row["scheme"], row["verdict"], f"{_cost(row):.2f}", f"{row['pressure_noise_pa']:.1f}",
            f"{row['mean_pressure_over_ideal']:.3f}", f"{row['mean_speed_m_s']:.4f}",
            f"{row['largest_speed_m_s']:.2f}", f"{row['iterations_per_relaxation']:.1f}",
        ))  # fmt: skip
    return table(head, lines)


def _cost_words(schemes: Mapping[str, Any]) -> str:
    """What the whole run of the recommended setting cost each time it was run."""
    rows = [row for row in [*schemes["again"], *schemes["rows"]] if row["scheme"] == RECOMMENDED]
    seconds = sorted(schemes["duration_s"] * _cost(row) for row in rows)
    each = ", ".join(f"{one:.1f}" for one in seconds)
    return (f"At {RECOMMENDED}, the setting to take, {schemes['duration_s']:g} s of the tank cost "
            f"{each} s of processor time in {len(rows)} runs.")  # fmt: skip


def _share_words(ran: Sequence[Row]) -> str:
    """Shares of the recommended setting, and the range over all."""
    pressure = [100.0 * row["pressure_share"] for row in ran]
    named = [row for row in ran if row["scheme"] == RECOMMENDED]
    own = ""
    if named:
        near = 100.0 * named[0]["neighbours_share"]
        own = (f"At {RECOMMENDED} building and solving the Poisson equation takes "
               f"{100.0 * named[0]['pressure_share']:.0f} % of a step and finding neighbours "
               f"{near:.0f} %. ")  # fmt: skip
    least, most = f"{min(pressure):.0f}", f"{max(pressure):.0f}"
    return f"{own}Over all schemes the Poisson equation takes {least} to {most} %."


def _solvers_table(rows: Sequence[Row]) -> str:
    head = ("unknowns", "solver", "iterations", "residual over right-hand side", "processor ms")
    return table(head, [
        (number(row["unknowns"]), row["solver"], f"{row['iterations'] or '-'}",
         f"{row['residual_fraction']:.2g}", f"{1e3 * row['cpu_s']:.3g}")
        for row in rows
    ]).rstrip()  # fmt: skip


def _large_words(row: Row) -> str:
    return (
        f"A full casting with a shoulder, {number(row['metal'])} particles of metal and "
        f"{number(row['particles'] - row['metal'])} of the mould, with {row['relaxations']} "
        f"relaxations: {row['cpu_s_per_step']:.1f} processor seconds a step "
        f"({100 * row['pressure_share']:.0f} % for the Poisson equation, "
        f"{row['iterations_per_step']:.0f} iterations) and "
        f"{row['peak_memory_bytes'] / 1e9:.2g} GB of memory at most."
    )


def _peers_words(rows: Sequence[Row], own: Row, duration_s: float) -> str:
    """A table with our own setting on top, or why there is no number."""
    ran = [row for row in rows if not row["stopped"]]
    failed = [f"{row['scheme']} gave no result: {row['stopped']}" for row in rows if row["stopped"]]
    if not ran:
        return "\n\n".join(failed)
    head = ("scheme", "version", "processor s a simulated s", "noise, Pa", "mean over rho g h",
            "mean speed, m/s")  # fmt: skip
    lines = [
        (row["scheme"], row.get("version", "this"), f"{_cost(row):.2f}",
         f"{row['pressure_noise_pa']:.1f}", f"{row['mean_pressure_over_ideal']:.3f}",
         f"{row['mean_speed_m_s']:.4f}")
        for row in [own, *ran]
    ]  # fmt: skip
    said = (
        f"Set as in PySPH's own dam_break_2d, quintic kernel, one thread, for {duration_s:g} s "
        "(all figures are of its second half, ours too); in an environment of its own "
        "(`benchmarks/peers/requirements_flow.txt`). What differs, and why, is said in "
        "`benchmarks/peers/run_pysph.py`. Where the mean speed is metres a second the metal has "
        "left the tank."
    )
    return "\n\n".join([said, table(head, lines).rstrip(), *failed])


def _draw(rows: Sequence[Row], path: Path) -> None:
    """Pressure noise and residual speed against cost, one numbered point a scheme."""
    figure = Figure(figsize=(11, 4.5), layout="constrained")
    axes = figure.subplots(1, 2)
    for axis, key, label in (
        (axes[0], "pressure_noise_pa", "standard deviation of pressure at 70 mm, Pa"),
        (axes[1], "mean_speed_m_s", "mean speed of metal at rest, m/s"),
    ):
        for place, row in enumerate(rows, 1):
            colour = "C2" if "version" in row else "C0" if row["source"] == "density" else "C1"
            axis.plot(_cost(row), row[key], "o", ms=4, color=colour)
            axis.annotate(
                f"{place}", (_cost(row), row[key]), xytext=(4, 2), textcoords="offset points",
                fontsize=8, color=colour,
            )  # fmt: skip
        axis.margins(0.1)
        axis.set(xscale="log", yscale="log", ylabel=label)
        axis.set_xlabel("processor time for a simulated second, s")
    names = [f"{place}  {row['scheme']}" for place, row in enumerate(rows, 1)]
    handles = [Line2D([], [], ls="", label=name) for name in names]
    figure.legend(handles=handles, loc="outside right upper", fontsize=8, handlelength=0)
    figure.savefig(path, dpi=120)
