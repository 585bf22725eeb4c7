"""The page on how far engines agree, from the committed results."""

from __future__ import annotations

from pathlib import Path

from benchmarks.agreement.recorded import read_all
from benchmarks.frame import render
from sandmould.execution.records import RECORDS
from sandmould.runs.formatting import name_of, number, seconds
from sandmould.statistics.agreement import interval_text

TWINS = "engine_twins"


def page(records: Path = RECORDS) -> str:
    """Write the page on the engines from the committed results.

    Raises
    ------
    SystemExit
        Naming the studies that have no record yet.
    """
    (twins,) = read_all(records, (TWINS,))
    return _render("engine_twins.md.j2", twins=twins)


def _render(template: str, **values: object) -> str:
    return render(Path(__file__).with_name(template), {
        **values, "number": number, "seconds": seconds, "name_of": name_of,
        "interval_text": interval_text,
    })  # fmt: skip
