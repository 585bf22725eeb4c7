"""The page docs/developers/speed.md, written from what was measured."""

from __future__ import annotations

from pathlib import Path
from typing import Any

from benchmarks.engines.rates import TARGETS
from benchmarks.engines.roofline import (
    CHAINED_PER_CONTACT,
    FLOPS_PER_CONTACT,
    FLOPS_PER_GRAIN,
    FLOPS_PER_PAIR,
    QUOTIENTS_PER_GRAIN,
    ROOTS_PER_CONTACT,
)
from benchmarks.engines.scale import SCALE_TARGET, THREADS_TARGET
from benchmarks.frame import render

STEP_PARTS = (
    ("within_pairs", "the loop over grains", "pairs: the loop over grains"),
    ("within_pairs", "pairs apart", "pairs: those looked at that do not touch"),
    ("within_pairs", "contacts", "pairs: contacts"),
    ("within_pairs", "guessing which", "pairs: guessing which touch"),
    ("parts", "surfaces", "walls"),
    ("parts", "gather", "sums from other chunks"),
    ("parts", "kick", "velocities (kick)"),
    ("parts", "drift", "positions (drift)"),
    ("parts", "rest", "rest"),
)


def _gflop_s(ns_per_flop: dict[str, float]) -> dict[str, float]:
    """Rates of operations from their times, with their range."""
    return {
        name: 1.0 / ns_per_flop[time]
        for name, time in (("median", "median"), ("least", "most"), ("most", "least"))
    }


def page(results: dict[str, Any]) -> str:
    """Write the page.

    Parameters
    ----------
    results : dict
        What ``benchmarks.engines`` measured.
    """
    peaks = results["roofline"]["peaks"]
    return render(Path(__file__).with_name("page.md.j2"), {
        **results,
        "ratio_targets": TARGETS,
        "threads_target": THREADS_TARGET,
        "scale_target": SCALE_TARGET,
        "missing": {n: text for row in results["rates"] for n, text in row["missing"].items()},
        "gflop_s": {kind: _gflop_s(peaks[f"{kind}_ns_per_flop"]) for kind in ("scalar", "vector")},
        "step_parts": STEP_PARTS,
        "operations": (
            ("pair looked at", FLOPS_PER_PAIR),
            ("contact", FLOPS_PER_CONTACT),
            ("grain", FLOPS_PER_GRAIN),
        ),
        "roots": ROOTS_PER_CONTACT,
        "chained": CHAINED_PER_CONTACT,
        "quotients": QUOTIENTS_PER_GRAIN,
    })  # fmt: skip
