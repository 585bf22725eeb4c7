"""The page docs/developers/speed.md, written from what was measured."""

from __future__ import annotations

from pathlib import Path
from typing import Any

from benchmarks.engines.rates import TARGETS
from benchmarks.engines.scale import SCALE_TARGET, THREADS_TARGET
from benchmarks.frame import render


def page(results: dict[str, Any]) -> str:
    """Write the page.

    Parameters
    ----------
    results : dict
        What ``benchmarks.engines`` measured.
    """
    return render(Path(__file__).with_name("page.md.j2"), {
        **results,
        "ratio_targets": TARGETS,
        "threads_target": THREADS_TARGET,
        "scale_target": SCALE_TARGET,
        "missing": {n: text for row in results["rates"] for n, text in row["missing"].items()},
    })  # fmt: skip
