"""The page on solidification."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path
from string import Template
from typing import Any

from benchmarks.arpm_charts import CASES, COMPETITORS, draw_contact, draw_courses, draw_ways
from benchmarks.arpm_ways import PAPERS
from benchmarks.tables import number, table
from sandmould import ROOT

DOCS = ROOT / "docs"
PAGE = DOCS / "solidification.md"
CHART = DOCS / "solidification.png"
CONTACT = DOCS / "solidification_contact.png"
COURSES = DOCS / "solidification_courses.png"
FIELDS = DOCS / "solidification_fields.png"
WORDS = Path(__file__).with_name("arpm_page.md")
PAPERS_SIZES_MM = (10.0, 5.0, 4.0, 2.5, 2.0, 1.0)
AS_FINE = (PAPERS[0], 2.0)
"""The paper's standard of accuracy, and what is to beat it."""
ADAPTIVE = ("2-3B, faces, local steps", 2.0)
FINEST_MM = 1.0
LOCAL = "uniform, faces, local steps"
LIMITS_PERCENT = (2.0, 1.0, 0.5, 0.2, 0.1)
Row = Mapping[str, Any]


def write(kept: Mapping[str, Any]) -> None:
    """Write page and pictures.

    Parameters
    ----------
    kept : mapping
        What ``arpm.json`` holds.
    """
    contact, ways, space = (kept[part]["rows"] for part in ("contact", "ways", "space"))
    limits = kept["limits"]
    draw_ways(ways, space, CHART)
    draw_courses(ways, COURSES)
    draw_contact(contact, CONTACT)
    origin = "; ".join(
        f"{name}: commit {part['commit']}, solver {part['solver']}, "
        f"{part['machine']['processor']}, load before {part['load_before']}"
        for name, part in kept.items()
    )
    text = Template(WORDS.read_text(encoding="utf-8")).substitute(
        verdict=_verdict(ways, space),
        contact=_contact_words(contact),
        contact_table=_contact_table(contact, "corrected"),
        printed_table=_contact_table(contact, "printed"),
        reference_mm=f"{ways[0]['size_mm']:g}",
        reference_s=f"{ways[0]['solidification_time_s']:.1f}",
        plates_table=_plates_table(ways),
        ways_table=_ways_table(ways, "A"),
        space_mm=f"{space[0]['size_mm']:g}",
        space_s=f"{space[0]['solidification_time_s']:.1f}",
        space_cpu_s=f"{space[0]['cpu_s']:.0f}",
        space_table=_ways_table(space, "plate"),
        steps_table=_steps_table(limits["steps"]),
        jumps_table=_jumps_table(limits["jumps"]),
        scatter_table=_scatter_table(limits["scatter"]),
        origin=f"{origin}.",
    )
    PAGE.write_text(text, encoding="utf-8")


def worst(row: Row) -> float:
    """The larger of the mean error at the worst probe and that of the solidification time, %."""
    return max(*row["mean_error_percent"].values(), abs(float(row["time_error_percent"])))


def cheapest(rows: Sequence[Row], error_percent: float, are_rivals: bool) -> Row | None:
    """The least costly of the rows that are no worse than an error; None if none is.

    Parameters
    ----------
    rows : sequence of rows
        The reference left out.
    error_percent : float
    are_rivals : bool
        Whether to look among finite differences and scikit-fem, or among elements.
    """
    good = [
        r for r in rows if worst(r) <= error_percent and (r["way"] in COMPETITORS) == are_rivals
    ]
    return min(good, key=lambda r: float(r["cpu_s"]), default=None)


def _verdict(ways: Sequence[Row], space: Sequence[Row]) -> str:
    """The cheapest elements and the cheapest competitor at several accuracies, and the target."""
    sought = (AS_FINE, ADAPTIVE, (PAPERS[0], FINEST_MM), (LOCAL, FINEST_MM))
    uniform, adaptive, kernels, local = (
        next(r for r in ways if (r["way"], r["size_mm"]) == one) for one in sought
    )
    (at_uniform, at_adaptive) = (r["mean_error_percent"]["A"] for r in (uniform, adaptive))
    return (
        f"{_race(ways, 'the 2D casting with four plates')}\n"
        f"{_race(space, 'the 3D block with a plate')}\n"
        f"Beside the paper's own way, one size of {AS_FINE[1]:g} mm ({uniform['cpu_s']:.1f} s, "
        f"{at_uniform:.3f} % at A, where kernels do not converge: they see the interface's "
        "resistance too small), three sizes with faces and "
        f"local steps take {adaptive['cpu_s']:.1f} s, {uniform['cpu_s'] / adaptive['cpu_s']:.1f} "
        f"times less, and are {at_adaptive:.3f} % off. {number(local['elements'])} elements of "
        f"{FINEST_MM:g} mm take {local['cpu_s']:.0f} s of one thread until all is solid with faces "
        f"and local steps, {ways[0]['cpu_s']:.0f} s with differences and {kernels['cpu_s']:.0f} s "
        "with kernels."
    )


def _race(rows: Sequence[Row], of: str) -> str:
    lines, won = [], 0
    for limit in LIMITS_PERCENT:
        ours, rival = (cheapest(rows[1:], limit, are_rivals) for are_rivals in (False, True))
        if ours is None or rival is None:
            continue
        times = float(rival["cpu_s"]) / float(ours["cpu_s"])
        won += times > 1.0
        lines.append([f"{limit:g}", _named(ours), _named(rival), f"{times:.2g}"])
    head = ["error, %", "cheapest elements", "cheapest competitor", "competitor's time over ours"]
    return (
        f"**{of[0].upper()}{of[1:]}: elements are cheaper than grids at {won} of {len(lines)} "
        "accuracies.** The error is the larger of the mean one of the worst probe's cooling curve "
        f"and that of the solidification time.\n\n{table(head, lines)}"
    )


def _named(row: Row) -> str:
    return f"{row['way']}, {row['size_mm']:g} mm: {row['cpu_s']:.2f} s, {worst(row):.2f} %"


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


def _ways_table(ways: Sequence[Row], probe: str) -> str:
    lines = [
        [r["way"], f"{r['size_mm']:g}", number(r["elements"]), number(r["element_steps"]),
         f"{r['cpu_s']:.2f}", f"{r['mean_error_percent'][probe]:.3f}",
         f"{r['time_error_percent']:+.2f}", f"{r['largest_drift_percent']:.1e}"]
        for r in sorted(ways[1:], key=lambda r: float(r["cpu_s"]))
    ]  # fmt: skip
    head = ["way", "smallest, mm", "elements", "element-steps", "processor, s",
            f"mean error at {probe}, %", "solidification time, %", "enthalpy drift, %"]  # fmt: skip
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
