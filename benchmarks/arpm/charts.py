"""The pictures of the page on solidification."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import matplotlib
from matplotlib.figure import Figure

from benchmarks.arpm.ways import PAPERS

matplotlib.use("Agg")
CASES = ("1-1", "1-2", "1-3", "1-4", "1-3A", "1-3B")
SMALLEST_COURSE_MM = 2.0
"""Courses of one size are shown from here up, as finer ones lie on the axis."""
Row = Mapping[str, Any]


def draw(results: Mapping[str, Any], folder: Path) -> None:
    """Draw all pictures that need no computation."""
    contact, ways = results["contact"]["rows"], results["ways"]["rows"]
    draw_courses(ways, folder / "solidification_courses.png")
    draw_contact(contact, folder / "solidification_contact.png")


def draw_courses(ways: Sequence[Row], path: Path) -> None:
    """Draw solidification time over size, error at A and enthalpy over time.

    They are ours of the paper's Figures 8, 9 and 11, and 14.
    """
    figure = Figure(figsize=(13, 4.4), layout="constrained")
    times, curves, drifts = figure.subplots(1, 3)
    for name in (PAPERS[0], "finite differences"):
        own = sorted((r for r in ways if r["way"] == name), key=lambda r: float(r["size_mm"]))
        times.plot([r["size_mm"] for r in own], [r["solidification_time_s"] for r in own],
                   marker="o", label=name)  # fmt: skip
    times.set(xlabel="element size, mm", ylabel="solid after, s")
    for row in (r for r in ways if r["way"] in PAPERS and r["size_mm"] >= SMALLEST_COURSE_MM):
        case = "2-1" if row["way"] == PAPERS[0] else str(row["way"]).split(",")[0]
        drawn = {"label": f"{case}, {row['size_mm']:g} mm", "lw": 1.2}
        drawn["ls"] = "--" if case == "2-1" else "-"
        curves.plot(row["course_s"], row["course_error_percent"], **drawn)
        if case != "2-1" and row["size_mm"] == SMALLEST_COURSE_MM:
            drifts.plot(row["course_s"], row["course_drift_percent"], **drawn)
    curves.set(xlabel="time, s", ylabel="warmer at A than the reference, % of 1530 K")
    drifts.set(xlabel="time, s", ylabel="change of the total enthalpy, %")
    for panel in (times, curves, drifts):
        panel.grid(alpha=0.3)
        panel.legend(fontsize=7)
    figure.savefig(path, dpi=120)


def draw_contact(rows: Sequence[Row], path: Path) -> None:
    """Figures 3 and 4 of the paper as ours."""
    figure = Figure(figsize=(9, 6.5), layout="constrained")
    panels = figure.subplots(2, 2, sharex=True)
    own = [r for r in rows if r["exchange"] == "corrected"]
    for line, resistance in zip(panels, sorted({r["resistance_m2k_w"] for r in own}), strict=True):
        for panel, cases in zip(line, (CASES[:4], ("1-1", "1-3", *CASES[4:])), strict=True):
            for case in cases:
                of_case = [
                    r for r in own if (r["case"], r["resistance_m2k_w"]) == (case, resistance)
                ]
                panel.plot([r["kernel_size"] for r in of_case],
                           [r["error_percent"] for r in of_case], marker="o", ms=4,
                           color=f"C{CASES.index(case)}", label=case)  # fmt: skip
            panel.axhline(0.0, color="black", lw=0.6)
            panel.set_ylabel(f"error (6), %, R = {resistance:g} m²K/W")
            panel.legend(fontsize=8)
    for panel in panels[1]:
        panel.set_xlabel("kernel size c_k")
    figure.savefig(path, dpi=120)
