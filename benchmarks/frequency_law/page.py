"""The pages on the law of the best frequency."""

from __future__ import annotations

import functools
import json
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import pandas as pd

from benchmarks.frame import render
from benchmarks.frequency_law import chart, groups, groups_chart
from benchmarks.frequency_law.controls import RecordedCurves
from benchmarks.frequency_law.fill_map import map_text
from benchmarks.frequency_law.screening import PROPERTIES, screen, told
from benchmarks.frequency_law.series import FREQUENCY, series_of
from sandmould import ROOT
from sandmould.execution.records import RECORDS
from sandmould.runs.formatting import number
from sandmould.scenario.scenario import Scenario
from sandmould.statistics.agreement import sweep_part
from sandmould.study.collect import read_summary, swept_keys
from sandmould.study.plan.expand import expand
from sandmould.study.plan.load_study import open_study

STUDIES = (
    "tube_law_springs",
    "tube_law_depth",
    "tube_law_hold",
    "tube_law_width",
    "tube_3d_frequency",
)
COLLAPSED = ("tube_law_springs", "tube_law_depth", "tube_law_hold")
"""Studies of one tube and one sand, which differ in springs, depth and what is held."""
HELD_OUT = {
    "tube_frequency": "grains two thirds as wide",
    "tube_frequency_stroke": "grains two thirds as wide, amplitude held",
    "tube_thickness_certified": "discs 10 mm thick instead of 3.42 mm",
}
"""Studies of the same tube that the law is asked for, not fitted to; what is special in them."""
OTHER_LENGTHS = {
    "tube_law_width": "tube",
    "tube_frequency": "grains two thirds as wide",
    "tube_law_gravity": "half the gravity, for root two times as long",
}
"""Studies in which one length of the scene, or gravity, is another; what it is."""
OF_THE_TUBE = ("tube_frequency", "tube_frequency_stroke", "tube_low_frequency")
"""Those that differ in the size of their grains alone: a plan's map is fitted to them as well. The
last is the low end of the first."""
PREDICTED_M_S = (0.02, 0.04, 0.08)
PREDICTED_IN_MODES = (0.1, 0.15, 0.2, 0.25, 0.3, 0.4, 0.5)
"""Where the page tabulates the law."""


def page(records: Path = RECORDS, picture: Path | None = None) -> str:
    """Write the law from the records that are there, and its picture where it is given a place."""
    there = _recorded(records)
    law = _law_of(records)
    studies = list(there.values())
    if picture is not None:
        if studies:
            chart.draw(studies, picture)
        if law:
            groups_chart.draw(
                law["settings"], PREDICTED_M_S, picture.with_stem(f"{picture.stem}_groups")
            )
    values = {
        "studies": studies,
        "names": list(there),
        "missing": [name for name in STUDIES if name not in there],
        "law": law,
        "number": number,
    }
    return render(Path(__file__).with_name("page.md.j2"), values)


def fill_map(records: Path = RECORDS) -> str:
    """Tabulate the law of all recorded curves of its tube and its sand, for plans of studies."""
    thrown = groups.thrown(_of_the_tube(records))
    return map_text(thrown, groups.error_of(thrown, groups.MAP))


def _of_the_tube(records: Path) -> pd.DataFrame:
    """Settings of all recorded curves of the tube, whose low end belongs to the curve above it."""
    curves = [s for name in COLLAPSED for s in _recorded(records)[name]["series"]]
    others = [RecordedCurves(records / name) for name in OF_THE_TUBE]
    settings = groups.settings_of([*curves, *(c for other in others for c in other.curves)])
    above, _, low = OF_THE_TUBE
    settings.loc[settings["study"] == low, ["study", "curve"]] = (
        settings.loc[settings["study"] == above, ["study", "curve"]].iloc[0].to_list()
    )
    return settings


def evidence(records: Path = RECORDS) -> str:
    """Write why these two numbers decide, and how well they predict."""
    law = _law_of(records)
    values = {
        "law": law,
        "dimensionless": groups.DIMENSIONLESS,
        "other_lengths": _other_lengths(law["settings"], records) if law else [],
        "screen": screen(records),
        "properties": list(PROPERTIES.values()),
        "told": told,
        "regrets": groups.regrets(groups.thrown(_of_the_tube(records)), (groups.LAW, groups.MAP)),
        "number": number,
    }
    return render(Path(__file__).with_name("evidence.md.j2"), values)


def _other_lengths(settings: pd.DataFrame, records: Path) -> list[tuple[str, str, list[float]]]:
    """What is another, the study, and the error of each dimensionless velocity."""
    found = []
    for name, what in OTHER_LENGTHS.items():
        if not (records / name / "record.json").is_file():
            continue
        for curve in _study(records / name)["series"]:
            others = groups.settings_of([curve])
            errors = [
                groups.held_out(settings, others, names).whole_error
                for names in groups.DIMENSIONLESS.values()
            ]
            label = f"{what} {curve.label}" if curve.label else what
            found.append((label, name, errors))
    return found


@functools.cache
def _recorded(records: Path) -> dict[str, dict[str, Any]]:
    """Studies of the law that are there."""
    return {
        name: _study(records / name)
        for name in STUDIES
        if (records / name / "record.json").is_file()
    }


@functools.cache
def _law_of(records: Path) -> dict[str, Any] | None:
    """The law and what it is asked for; none before all studies that it is fitted to are there."""
    there = _recorded(records)
    others = [
        RecordedCurves(records / name)
        for name in HELD_OUT
        if (records / name / "record.json").is_file()
    ]
    return _law(there, others) if all(name in there for name in COLLAPSED) else None


def _study(folder: Path) -> dict[str, Any]:
    record = json.loads((folder / "record.json").read_text(encoding="utf-8"))
    opened = open_study(ROOT / record["study"])
    summary = sweep_part(read_summary(folder))
    keys = swept_keys(summary)
    other = next((key for key in keys if key != FREQUENCY), None)
    scenarios: dict[Any, Scenario] = {}
    for run in expand(opened):
        scenarios.setdefault(None if other is None else run.parameters[other], run.scenario)
    series = series_of(folder.name, summary, keys, scenarios)
    return {
        "name": folder.name,
        "title": opened.study.title,
        "series": series,
        "record": record,
        "runs": len(summary),
    }


def _law(there: Mapping[str, dict[str, Any]], others: Sequence[RecordedCurves]) -> dict[str, Any]:
    every = groups.settings_of([s for name in COLLAPSED for s in there[name]["series"]])
    settings = groups.thrown(every)
    law = groups.FillLaw(settings)
    asked = pd.DataFrame(
        [
            (velocity, in_modes)
            for velocity in PREDICTED_M_S
            for low, high in [groups.shaken_range(settings, velocity)]
            for in_modes in PREDICTED_IN_MODES
            if low <= in_modes <= high
        ],
        columns=list(groups.LAW),
    )
    asked["fill"] = law.at(asked)
    return {
        "settings": settings,
        "at_rest": len(every) - len(settings),
        "error_with_all": groups.error_of(every),
        "names": groups.GROUPS,
        "collapses": groups.collapses(settings),
        "explanations": {
            what: groups.error_of(settings, needed) for what, needed in groups.EXPLANATIONS.items()
        },
        "predicted_in_modes": PREDICTED_IN_MODES,
        "predicted": {
            v: dict(zip(mine["in_modes"], mine["fill"], strict=True))
            for v, mine in asked.groupby("velocity_m_s")
        },
        "held_out": [
            (HELD_OUT[study.name], curve, groups.held_out(settings, groups.settings_of([curve])))
            for study in others
            for curve in study.curves
            if not curve.label
        ],
    }
