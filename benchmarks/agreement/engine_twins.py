"""The page on how far the engines agree, from the committed results: ``docs/engine_twins.md``."""

from __future__ import annotations

from pathlib import Path

from benchmarks.agreement.recorded import read_all
from benchmarks.frame import render
from sandmould.execution.records import RECORDS
from sandmould.runs.formatting import name_of, number, seconds
from sandmould.statistics.agreement import interval_text

TWINS = "engine_twins"
EFFECTS = ("damping_forms", "contact_readings", "rolling_axes", "frames")
"""Studies that measure one difference at a time, by the same machinery."""


def page(records: Path = RECORDS) -> str:
    """Write the page from the committed results.

    Raises
    ------
    SystemExit
        Naming the studies that have no record yet.
    """
    twins, *effects = read_all(records, (TWINS, *EFFECTS))
    return render(Path(__file__).with_name("engine_twins.md.j2"), {
        "twins": twins, "effects": effects, "number": number, "seconds": seconds,
        "name_of": name_of, "interval_text": interval_text,
    })  # fmt: skip
