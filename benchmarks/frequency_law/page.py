"""The page on the law of the best frequency: ``docs/frequency_law.md``."""

from __future__ import annotations

import json
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pandas as pd

from benchmarks.frame import render
from benchmarks.frequency_law.chart import draw
from benchmarks.frequency_law.series import FREQUENCY, Power, Series, power_of, series_of
from sandmould import ROOT
from sandmould.runs.formatting import number, seconds
from sandmould.scenario.scenario import Scenario
from sandmould.study.collect import read_summary, swept_keys
from sandmould.study.plan.expand import expand
from sandmould.study.plan.load_study import open_study
from sandmould.study.records import RECORDS

STUDIES = ("tube_law_springs", "tube_law_depth", "tube_law_hold", "tube_law_width")
POWERS: dict[str, tuple[str, str, Callable[[Series], float]]] = {
    "tube_law_springs": ("wave speed c", "1", lambda series: series.wave_speed_m_s),
    "tube_law_depth": ("depth H of the bed", "-1", lambda series: series.depth_m),
    "tube_law_width": (
        "width of the tube",
        "0",
        lambda s: s.scenario.scene.bores[0].section_measure,
    ),
}
"""What changes between the curves of a study, and its exponent were f in proportion to c/(4 H)."""


def page(records: Path = RECORDS, picture: Path | None = None) -> str:
    """Write the page from the records that are there, and its picture where it is given a place."""
    studies, missing = [], []
    for name in STUDIES:
        folder = records / name
        if (folder / "record.json").is_file():
            studies.append(_study(folder))
        else:
            missing.append(name)
    if studies and picture is not None:
        draw(studies, picture)
    values = {"studies": studies, "missing": missing, "number": number, "seconds": seconds}
    return render(Path(__file__).with_name("page.md.j2"), values)


def _study(folder: Path) -> dict[str, Any]:
    record = json.loads((folder / "record.json").read_text(encoding="utf-8"))
    opened = open_study(ROOT / record["study"])
    summary = read_summary(folder)
    keys = swept_keys(pd.read_csv(folder / "runs.tsv", sep="\t"))
    other = next(key for key in keys if key != FREQUENCY)
    scenarios: dict[Any, Scenario] = {}
    for run in expand(opened):
        scenarios.setdefault(run.parameters[other], run.scenario)
    series = series_of(folder.name, summary, keys, scenarios)
    return {
        "name": folder.name,
        "title": opened.study.title,
        "series": series,
        "record": record,
        "runs": len(summary),
        "power": _power(folder.name, series),
    }


def _power(study: str, series: list[Series]) -> tuple[str, str, Power | None] | None:
    if study not in POWERS:
        return None
    what, expected, changed = POWERS[study]
    return what, expected, power_of(series, [changed(s) for s in series])
