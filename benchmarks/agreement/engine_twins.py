"""The pages on how far engines and choices of the model agree, from the committed results."""

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
    """Write the page on the engines from the committed results.

    Raises
    ------
    SystemExit
        Naming the studies that have no record yet.
    """
    (twins,) = read_all(records, (TWINS,))
    return _render("engine_twins.md.j2", twins=twins)


def one_difference(records: Path = RECORDS) -> str:
    """Write the page on what a choice of the model does.

    Raises
    ------
    SystemExit
        Naming the studies that have no record yet.
    """
    return _render("one_difference.md.j2", effects=read_all(records, EFFECTS))


def _render(template: str, **values: object) -> str:
    return render(Path(__file__).with_name(template), {
        **values, "number": number, "seconds": seconds, "name_of": name_of,
        "interval_text": interval_text,
    })  # fmt: skip
