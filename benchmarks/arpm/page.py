"""The pages on solidification."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any, NamedTuple

from benchmarks.arpm.charts import CASES
from benchmarks.arpm.ways import PAPERS
from benchmarks.frame import render

PAPERS_SIZES_MM = (10.0, 5.0, 4.0, 2.5, 2.0, 1.0)
KERNEL_SIZES = (1.4, 2.4, 3.2, 4.2)
"""Of the contact cases in tables; the picture has all."""
JUMP_SIZES = (1.4, 2.1, 4.2)
"""Kernels of the jumps of sizes in the table."""
Row = Mapping[str, Any]


class Pivot(NamedTuple):
    """One value of rows, by some of their keys and over another."""

    columns: list[Any]
    lines: dict[tuple[Any, ...], list[Any]]


def page(results: Mapping[str, Any]) -> str:
    """Write the page on the casting with four plates.

    Parameters
    ----------
    results : mapping
        What ``benchmarks.arpm`` measured.
    """
    ways = results["ways"]["rows"]
    return render(Path(__file__).with_name("page.md.j2"), {
        "papers": PAPERS,
        "ways": ways,
        "papers_rows": [
            r for r in ways if r["way"] in PAPERS and r["size_mm"] in PAPERS_SIZES_MM
        ],
        "origins": {name: part for name, part in results.items() if "solver" in part},
    })  # fmt: skip


def failures(results: Mapping[str, Any]) -> str:
    """Write the page on where the ways fail.

    Parameters
    ----------
    results : mapping
    """
    contact, limits = results["contact"]["rows"], results["limits"]
    faces = [r for r in contact if r["exchange"] == "faces"]
    of_one_side = [
        r for r in contact
        if (r["exchange"], r["case"], r["resistance_m2k_w"]) == ("corrected", "1-3A", 0.0)
    ]  # fmt: skip
    return render(Path(__file__).with_name("limits.md.j2"), {
        "contact_errors": {form: _contact_errors(contact, form)
                           for form in ("corrected", "printed")},
        "least_of_one_side": min(of_one_side, key=lambda r: abs(r["error_percent"])),
        "faces_most_percent": max(abs(r["error_percent"]) for r in faces),
        "faces_largest_k": max(r["largest_k"] for r in faces),
        "limits": limits,
        "jumps": pivot(
            [r for r in limits["jumps"] if r["kernel_size"] in (None, *JUMP_SIZES)],
            ("exchange", "kernel_size"), "ratio", "largest_k",
        ),
        "scatter": pivot(limits["scatter"], ("exchange",), "scatter", "largest_k"),
    })  # fmt: skip


def pivot(rows: Sequence[Row], by: Sequence[str], over: str, value: str) -> Pivot:
    """Lines by some keys, columns by another in its order."""
    columns = sorted({r[over] for r in rows})
    values = {(*(r[key] for key in by), r[over]): r[value] for r in rows}
    lines = dict.fromkeys(tuple(r[key] for key in by) for r in rows)
    return Pivot(columns, {line: [values[*line, column] for column in columns] for line in lines})


def _contact_errors(rows: Sequence[Row], form: str) -> Pivot:
    """Error (6) of each case over the size of the kernel, in the paper's order."""
    own = sorted(
        (r for r in rows if r["exchange"] == form and r["kernel_size"] in KERNEL_SIZES),
        key=lambda r: (r["resistance_m2k_w"], CASES.index(r["case"])),
    )
    return pivot(own, ("resistance_m2k_w", "case"), "kernel_size", "error_percent")
