"""The page on solidification and its pictures."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path
from string import Template
from typing import Any

import matplotlib
from matplotlib.figure import Figure

from benchmarks.arpm_ways import FEM
from benchmarks.tables import number, table
from sandmould import ROOT

matplotlib.use("Agg")
PAGE = ROOT / "docs" / "solidification.md"
CHART = ROOT / "docs" / "solidification.png"
CONTACT = ROOT / "docs" / "solidification_contact.png"
WORDS = Path(__file__).with_name("arpm_page.md")
CASES = ("1-1", "1-2", "1-3", "1-4", "1-3A", "1-3B")
PAPERS = ("uniform, printed or corrected", "2-2A, corrected", "2-2B, corrected",
          "2-3A, corrected", "2-3B, corrected")  # fmt: skip
PAPERS_SIZES_MM = (10.0, 5.0, 4.0, 2.5, 2.0, 1.0)
AS_FINE = (PAPERS[0], 2.0)
"""Whose error the others are to reach: the paper's standard of accuracy."""
COMPETITORS = ("finite differences", FEM)
Row = Mapping[str, Any]


def write(kept: Mapping[str, Any]) -> None:
    """Write page and pictures.

    Parameters
    ----------
    kept : mapping
        What ``arpm.json`` holds.
    """
    contact, ways, limits = kept["contact"]["rows"], kept["ways"]["rows"], kept["limits"]
    _draw_ways(ways)
    _draw_contact(contact)
    origin = "; ".join(
        f"{name}: commit {part['commit']}, solver {part['solver']}, {part['machine']['processor']}"
        for name, part in kept.items()
    )
    text = Template(WORDS.read_text(encoding="utf-8")).substitute(
        verdict=_verdict(ways),
        contact=_contact_words(contact),
        contact_table=_contact_table(contact, "corrected"),
        printed_table=_contact_table(contact, "printed"),
        reference_mm=f"{ways[0]['size_mm']:g}",
        reference_s=f"{ways[0]['solidification_time_s']:.1f}",
        plates_table=_plates_table(ways),
        ways_table=_ways_table(ways),
        steps_table=_steps_table(limits["steps"]),
        jumps_table=_jumps_table(limits["jumps"]),
        scatter_table=_scatter_table(limits["scatter"]),
        origin=f"{origin}.",
    )
    PAGE.write_text(text, encoding="utf-8")


def at_a(row: Row) -> float:
    """Mean error at A, where it is largest, %."""
    return float(row["mean_error_percent"]["A"])


def cheapest(rows: Sequence[Row], error_percent: float, among: Sequence[str] | None = None
             ) -> Row | None:  # fmt: skip
    """The least costly of the ways that are no worse at A than an error; None if none is.

    Parameters
    ----------
    rows : sequence of rows
        The reference left out.
    error_percent : float
    among : sequence of str, optional
        Names of ways.
    """
    good = [r for r in rows if at_a(r) <= error_percent and (not among or r["way"] in among)]
    return min(good, key=lambda r: float(r["cpu_s"]), default=None)


def _verdict(ways: Sequence[Row]) -> str:
    rows = ways[1:]
    standard = next(r for r in rows if (r["way"], r["size_mm"]) == AS_FINE)
    elements = [r["way"] for r in rows if r["way"] not in COMPETITORS]
    said = [
        f"One size of {AS_FINE[1]:g} mm with the paper's weights costs "
        f"{standard['cpu_s']:.1f} s and is {at_a(standard):.3f} % off at A."
    ]
    best = cheapest(rows, at_a(standard), elements)
    rival = cheapest(rows, at_a(standard), COMPETITORS)
    for found, kind in ((best, "elements"), (rival, "competitors")):
        if found:
            said.append(
                f"No worse and cheapest of the {kind}: {found['way']}, {found['size_mm']:g} mm, "
                f"{found['cpu_s']:.2f} s, {standard['cpu_s'] / found['cpu_s']:.1f} times as cheap, "
                f"{at_a(found):.3f} %."
            )
    if best and rival:
        first, second = sorted((best, rival), key=lambda r: float(r["cpu_s"]))
        said.insert(
            0,
            f"**At the accuracy of the paper's 2 mm {first['way']} wins: "
            f"{second['cpu_s'] / first['cpu_s']:.1f} times as cheap as {second['way']}.**",
        )
    return " ".join(said)


def _contact_words(rows: Sequence[Row]) -> str:
    of_faces = [r for r in rows if r["exchange"] == "faces"]
    most = max(abs(r["error_percent"]) for r in of_faces)
    of_one_side = [
        r for r in rows
        if (r["exchange"], r["case"], r["resistance_m2k_w"]) == ("corrected", "1-3A", 0.0)
    ]  # fmt: skip
    least = min(of_one_side, key=lambda r: abs(r["error_percent"]))
    return (
        f"Without resistance the error of 1-3A is least at c_k = {least['kernel_size']:g}. True "
        "faces have no kernel: in all cases, with and without resistance, they are within "
        f"{most:.4f} %, and {max(r['largest_k'] for r in of_faces):.2f} K at most."
    )


def _contact_table(rows: Sequence[Row], form: str) -> str:
    own = [r for r in rows if r["exchange"] == form]
    sizes = sorted({r["kernel_size"] for r in own})
    lines = [
        [case, f"{resistance:g}", *(
            f"{r['error_percent']:+.2f}"
            for size in sizes
            for r in own
            if (r["case"], r["resistance_m2k_w"], r["kernel_size"]) == (case, resistance, size)
        )]
        for resistance in sorted({r["resistance_m2k_w"] for r in own})
        for case in CASES
    ]  # fmt: skip
    head = ["case, error (6) in %", "R, m²K/W", *(f"c_k = {size:g}" for size in sizes)]
    return table(head, lines)


def _plates_table(ways: Sequence[Row]) -> str:
    own = [r for r in ways if r["way"] in PAPERS and r["size_mm"] in PAPERS_SIZES_MM]
    lines = [
        [
            "2-1" if r["way"] == PAPERS[0] else str(r["way"]).split(",")[0],
            f"{r['size_mm']:g}", number(r["elements"]),
            ", ".join(f"{size} mm: {number(count)}" for size, count in r["counts"].items()),
            f"{r['solidification_time_s']:.1f}", f"{r['time_error_percent']:+.2f}",
            *(f"{r['mean_error_percent'][p]:.3f} / {r['largest_error_percent'][p]:.2f}"
              for p in "ABCDE"),
            f"{r['largest_drift_percent']:.2g}", f"{r['cpu_s']:.1f}",
        ]
        for r in own
    ]  # fmt: skip
    head = ["case", "smallest, mm", "elements", "of each size", "solid after, s", "off by, %",
            *"ABCDE", "enthalpy drift, %", "processor, s"]  # fmt: skip
    return table(head, lines)


def _ways_table(ways: Sequence[Row]) -> str:
    lines = [
        [r["way"], f"{r['size_mm']:g}", number(r["elements"]), number(r["element_steps"]),
         f"{r['cpu_s']:.2f}", f"{at_a(r):.3f}", f"{r['time_error_percent']:+.2f}",
         f"{r['largest_drift_percent']:.1e}"]
        for r in sorted(ways[1:], key=lambda r: float(r["cpu_s"]))
    ]  # fmt: skip
    head = ["way", "smallest, mm", "elements", "element-steps", "processor, s",
            "mean error at A, %", "solidification time, %", "enthalpy drift, %"]  # fmt: skip
    return table(head, lines)


def _kelvin(value: float | None) -> str:
    return "lost" if value is None else f"{value:.2g}"


def _steps_table(rows: Sequence[Row]) -> str:
    shares = list(rows[0]["largest_k"])
    lines = [
        [r["exchange"], f"{r['planned_s']:.3f}", *(_kelvin(r["largest_k"][s]) for s in shares),
         f"{r['grows_beyond']:.2f}"]
        for r in rows
    ]  # fmt: skip
    return table(["form", "that step, s", *shares, "a mode grows beyond"], lines)


def _jumps_table(rows: Sequence[Row]) -> str:
    ratios = sorted({r["ratio"] for r in rows})
    ways = list(dict.fromkeys((r["exchange"], r["kernel_size"]) for r in rows))
    found = {(r["exchange"], r["kernel_size"], r["ratio"]): r["largest_k"] for r in rows}
    lines = [
        [form, "" if size is None else f"{size:g}",
         *(_kelvin(found[form, size, ratio]) for ratio in ratios)]
        for form, size in ways
    ]  # fmt: skip
    return table(["form", "c_k", *(f"1 to {ratio}" for ratio in ratios)], lines)


def _scatter_table(rows: Sequence[Row]) -> str:
    scatters = sorted({r["scatter"] for r in rows})
    found = {(r["exchange"], r["scatter"]): r["largest_k"] for r in rows}
    forms = list(dict.fromkeys(r["exchange"] for r in rows))
    lines = [[form, *(_kelvin(found[form, s]) for s in scatters)] for form in forms]
    return table(["form", *(f"{s:g}" for s in scatters)], lines)


def _draw_ways(ways: Sequence[Row]) -> None:
    """Mean error at the thinnest plate over the processor's time."""
    figure = Figure(figsize=(9, 6), layout="constrained")
    axes = figure.subplots()
    for place, name in enumerate(dict.fromkeys(r["way"] for r in ways[1:])):
        own = [r for r in ways[1:] if r["way"] == name]
        rival = name in COMPETITORS
        axes.loglog(
            [r["cpu_s"] for r in own], [at_a(r) for r in own], marker="osD^vP*X<>hpd8"[place],
            color="black" if rival else f"C{place % 10}", ls="--" if rival else "-", lw=1.2,
            label=name,
        )  # fmt: skip
    axes.set_xlabel("processor time, s")
    axes.set_ylabel("mean error of the cooling curve at A, % of 1530 K")
    axes.grid(alpha=0.3, which="both")
    figure.legend(loc="outside right upper", fontsize=8)
    figure.savefig(CHART, dpi=120)


def _draw_contact(rows: Sequence[Row]) -> None:
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
    figure.savefig(CONTACT, dpi=120)
