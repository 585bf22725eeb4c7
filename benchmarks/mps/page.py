"""The page on metal flow."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import Any

from benchmarks.frame import render

RECOMMENDED = "MR10-0.5"
"""One of the two cheapest among the calm settings of ``tank_map``."""


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
        "costs_s": sorted(schemes["duration_s"] * row["cpu_s_per_simulated_s"] for row in runs),
        "shares": [row["pressure_share"] for row in schemes["rows"] if not row["stopped"]],
        "casting": results["large"]["row"],
        "origins": {name: part for name, part in results.items() if "solver" in part},
    })  # fmt: skip
