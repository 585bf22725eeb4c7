"""The page docs/developers/calibration_peers.md, written from what was measured."""

from __future__ import annotations

from pathlib import Path
from typing import Any

from benchmarks.frame import render


def page(results: dict[str, Any]) -> str:
    """Write the page.

    Parameters
    ----------
    results : dict
        What ``benchmarks.calibration`` measured, by part: ``emulator``, ``dem`` or both.
    """
    first = next(iter(results.values()))
    values = {**results, "first": first, "early_ends": early_ends}
    return render(Path(__file__).with_name("page.md.j2"), values)


def early_ends(rows: list[dict[str, Any]]) -> list[str]:
    """Sentences on methods that ended before the cap, each once."""
    lines = [
        f"{row['method']}, {row['target_deg']:g} degrees, ended before the cap: "
        f"{'; '.join(row['ended'])}."
        for row in rows
        if row["ended"]
    ]
    return list(dict.fromkeys(lines))
