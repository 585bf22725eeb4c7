"""What the report of a study of solidification says and shows of its own.

Fields, cooling curves, error and cost.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import pandas as pd

from sandmould.definition.sweep import Point
from sandmould.drawing.chart import PLAIN, Chart, Line, LineStyle, Mark, tints
from sandmould.drawing.figure_files import numbered, pictures
from sandmould.drawing.sphere_film import SphereFilm
from sandmould.kinds.solidification.kind import SolidificationStudy
from sandmould.report.cast_fields import cast_fields, cast_scene
from sandmould.report.curves import curve_figures, measure_curves
from sandmould.report.kinds.kind import Findings, KindPages, KindReport
from sandmould.report.tables import Cell, Column, ReportPicture, Table, cells
from sandmould.runs.columns import CPU_S, DETAIL, RUN, SOLIDIFICATION_TIME_S, TIME_S, finished
from sandmould.runs.formatting import is_number, listed, name_of, number, seconds, setting_text
from sandmould.runs.templates import notes, worded
from sandmould.scenario.casting.solidification import Solidification
from sandmould.scenario.units import ZERO_K
from sandmould.statistics.answer import Answer
from sandmould.statistics.refining import resolution_among
from sandmould.statistics.verdict import rank_runs
from sandmould.study.collect import Collected
from sandmould.wording.answer import AnswerWords
from sandmould.wording.next_steps import NextStep, step

NEAR_PERCENT = 5.0
"""Off the reference's solidification time: as near as the answer takes for good."""
_FIRST = ("Last", "Feeding", "Height")
"""Findings that answer a study of one casting."""
MOST_POINTS = 600
"""Of a cooling curve."""


@dataclass(frozen=True)
class _Error:
    """How far one run is from the reference."""

    label: str
    cpu_s: float
    time_percent: float
    curve_percent: float
    """Error (7) of the worst probe, % of the initial difference; NaN without probes."""


def _notes(
    scenario: Solidification, collected: Collected, seeks_best: bool, is_controlled: bool
) -> tuple[str, ...]:
    """What two dimensions leave out."""
    flat = "Two dimensions: heat that leaves a casting across the plane is not counted."
    return (flat,) if scenario.dimensions == 2 else ()


def _pages(findings: Findings[Solidification], film_budget_bytes: int) -> KindPages:
    """Fields, cooling curves, error and cost."""
    study, scenario, verdict = findings.study, findings.scenario, findings.verdict
    collected, keys = findings.collected.of_sweep, findings.collected.keys
    # A study whose file is missing is read as one of sand.
    reference = study.reference if isinstance(study, SolidificationStudy) else {}
    best = _run_of(collected.summary, findings.answer) if study.seeks_best or not reference else ""
    run = _pictured_run(reference, collected, best)
    folder = findings.study_folder / "runs" / run
    cooling = _cooling(run, collected.curves, scenario)
    curves = measure_curves(collected, verdict, ["solidified_fraction"])
    fields, first, said, tables, fed, fed_by = cast_fields(folder, scenario)
    errors = _errors(reference, scenario, collected) if reference else []
    error_cost = _error_charts(errors)
    cheapest = "" if study.seeks_best else _cheapest(errors, reference, collected)
    is_one = len(said) > 1 and not keys and not study.seeks_best
    first_said = [text for text in said if text.partition(":")[0] in _FIRST]
    texts = [text.partition(": ")[2] for text in first_said]
    if keys:
        said = _said_of(collected.summary, run, keys, said)
    stand_ins = _stand_ins(findings.answer.stand_ins)
    shown = {
        "pictured_run": run,
        "scene": cast_scene(folder, scenario, fed) if fed else None,
        "films": (SphereFilm(run=run),),
        "fields": fields,
        "sentences": stand_ins,
        "tables": tables,
        "cooling": cooling,
        "has_risers": bool(scenario.risers),
        "curves": curves,
        "reference": setting_text(reference) if reference else "",
        "error_cost": error_cost,
        "errors": _error_table(errors) if errors else None,
    }
    return KindPages(
        "solidification.html",
        notes("freezing_method.j2", heat=scenario, swept=[name_of(key) for key in keys]),
        context={"pages": shown},
        figures={
            **pictures(fields=fields),
            **numbered("error_cost", error_cost),
            **curve_figures([*([cooling] if cooling else []), *curves]),
        },
        picture=ReportPicture(*first) if first[0] else None,
        findings=tuple(t for t in said if t not in first_said) if is_one else said,
        answer=worded("cast_answer.j2", it=AnswerWords(findings.answer), said=texts)
        if is_one
        else cheapest,
        grounds=notes(
            "casting_grounds.j2",
            has_stand_ins=bool(stand_ins),
            dimensions=scenario.dimensions,
        ),
        steps=(*_longer(collected.summary), *_steps(scenario, keys, bool(reference), fed_by)),
    )


def _said_of(
    summary: pd.DataFrame, run: str, keys: Sequence[str], said: Sequence[str]
) -> tuple[str, ...]:
    """Findings, the first with the setting of the one run that they are of."""
    row = summary[summary[RUN].astype(str) == run]
    name, colon, rest = said[0].partition(":")
    if row.empty or not colon:
        return tuple(said)
    label = setting_text({key: row.iloc[0][key] for key in keys})
    return (f"{name}, with {label}{colon}{rest}", *said[1:])


def _longer(summary: pd.DataFrame) -> tuple[NextStep, ...]:
    """More time, where runs ended before the casting was solid and more would let it be."""
    if DETAIL not in summary:
        return ()
    ended = summary[DETAIL].astype(str).str.contains("raise until_s").sum()
    until_s = Solidification.model_fields["until_s"].default
    line = f"scenario: {{until_s: {until_s:g}}}"
    return (step("until", line, runs=int(ended)),) if ended else ()


def _steps(
    scenario: Solidification,
    keys: Sequence[str],
    has_reference: bool,
    riser: tuple[NextStep, ...],
) -> tuple[NextStep, ...]:
    """What feeds the casting; finer elements, where no reference tells how good these are."""
    if has_reference:
        text = "Take these elements for a casting of this kind, and check them once by finer ones."
        return (NextStep(text),)
    if resolution_among(keys):
        return riser
    finer = f"scenario: {{element_m: {scenario.element_m / 2:g}}}"
    return (
        *riser,
        NextStep("See whether the result stays with elements half as large:", finer),
    )


def _run_of(summary: pd.DataFrame, answer: Answer) -> str:
    """The finest run, or else the best of the objective; empty where none finished."""
    if answer.refining is not None:
        done = summary[finished(summary)]
        return str(done.sort_values(answer.refining.key)[RUN].iloc[0])
    return rank_runs(summary, answer.asked.measure, answer.asked.better).get("best", "")


def _stand_ins(keys: Sequence[str]) -> tuple[str, ...]:
    """Which values are not what they stand for."""
    if not keys:
        return ()
    names = [
        f"initial temperature of the {key.rpartition('.')[2]}"
        if key.startswith("initial_k.")
        else f"{key.rpartition('.')[0].replace('.', ' ')} {name_of(key)}".strip()
        for key in keys
    ]
    return (f"Placeholder values, so do not use these times for your alloy: "
            f"{listed(names, most=20)}.",)  # fmt: skip


def _pictured_run(reference: Point, collected: Collected, best: str) -> str:
    """Run whose fields are shown: the best, else the reference, else the first that finished."""
    done = collected.summary[finished(collected.summary)]
    runs = [best, *_of_point(done, reference)[RUN].astype(str), *done[RUN].astype(str)]
    return next((run for run in runs if run), "")


def _of_point(summary: pd.DataFrame, reference: Point) -> pd.DataFrame:
    """Rows of the reference; swept values are as ``runs.tsv`` has them."""
    chosen = np.ones(len(summary), dtype=bool)
    for key, value in reference.items():
        kind = float if is_number(value) else str
        chosen &= (summary[key].astype(kind) == kind(value)).to_numpy()
    return summary[chosen]


def _cooling(run: str, curves: pd.DataFrame, scenario: Solidification) -> Chart | None:
    """Cooling curves of all probes of a run; of the other runs faint, behind them."""
    names = [probe.name for probe in scenario.probes]
    if not names or curves.empty:
        return None
    lines = []
    for name, tint in zip(names, tints(len(names), False), strict=True):
        for of, own in curves.groupby(RUN):
            xy = own[[TIME_S, f"{name}_k"]].to_numpy(dtype=np.float64) - [0.0, ZERO_K]
            xy = xy[:: max(1, len(xy) // MOST_POINTS)]
            style: LineStyle = "mean" if of == run else "behind"
            lines.append(Line(xy, tint, style, name if of == run else "", f"{name}, {of}"))
    end_s = float(curves[TIME_S].max())
    for what in ("liquidus", "solidus"):
        at = getattr(scenario.casting, f"{what}_k") - ZERO_K
        lines.append(Line(np.array([[0.0, at], [end_s, at]]), PLAIN, "joined", title=what))
    lines.sort(key=lambda line: line.style == "mean")
    alt = f"Cooling curves of {listed(names)} in degrees C, with liquidus and solidus."
    return Chart("time, s", "temperature, °C", alt, tuple(lines))


def _errors(point: Point, scenario: Solidification, collected: Collected) -> list[_Error]:
    """Each finished run against the reference; nothing where that did not finish."""
    done = collected.summary[finished(collected.summary)]
    reference = _of_point(done, point)
    if reference.empty:
        return []
    base = reference.iloc[0]
    own = dict(list(collected.curves.groupby(RUN)))
    probes = [f"{probe.name}_k" for probe in scenario.probes]
    range_k = scenario.initial_k.casting - scenario.initial_k.mould
    errors = []
    for _, row in done.iterrows():
        if row[RUN] == base[RUN]:
            continue
        time_s, base_s = float(row[SOLIDIFICATION_TIME_S]), float(base[SOLIDIFICATION_TIME_S])
        curve = _curve_percent(own[row[RUN]], own[base[RUN]], probes, range_k)
        label = setting_text({key: row[key] for key in collected.keys})
        errors.append(_Error(label, float(row[CPU_S]), 100.0 * (time_s / base_s - 1.0), curve))
    return sorted(errors, key=lambda error: error.cpu_s)


def _cheapest(errors: Sequence[_Error], reference: Point, collected: Collected) -> str:
    """The cheapest setting that is near the reference; empty where there is none to compare."""
    errors = [e for e in errors if math.isfinite(e.time_percent)]
    if not errors:
        return ""
    near = [e for e in errors if abs(e.time_percent) <= NEAR_PERCENT]
    done = collected.summary[finished(collected.summary)]
    return worded(
        "cheapest.j2",
        near=near[0] if near else None,
        nearest=min(errors, key=lambda e: abs(e.time_percent)),
        near_percent=NEAR_PERCENT,
        reference_s=float(_of_point(done, reference)[CPU_S].iloc[0]),
    )


def _curve_percent(
    table: pd.DataFrame, base: pd.DataFrame, probes: Sequence[str], range_k: float
) -> float:
    """Error (7) of the worst probe over the time that both runs have."""
    end_s = min(table[TIME_S].max(), base[TIME_S].max())
    time_s = base[TIME_S].to_numpy()
    time_s = time_s[time_s <= end_s]
    off = [
        np.abs(np.interp(time_s, table[TIME_S], table[p]) - base[p].to_numpy()[: len(time_s)])
        for p in probes
    ]
    return max((100.0 * float(np.trapezoid(o, time_s)) / (range_k * end_s) for o in off),
               default=math.nan)  # fmt: skip


def _error_charts(errors: Sequence[_Error]) -> tuple[Chart, ...]:
    """Both errors over the processor's time on logarithmic axes, settings by their number."""
    colours = tints(len(errors), False)
    charts = []
    for what, values in (
        ("error of the solidification time, %", [abs(e.time_percent) for e in errors]),
        ("mean error of the worst cooling curve, %", [e.curve_percent for e in errors]),
    ):
        marks = tuple(
            Mark(error.cpu_s, value, "mean", tint, title=f"{error.label}: {number(value)} %",
                 label=str(place))
            for place, (error, value, tint) in enumerate(
                zip(errors, values, colours, strict=True), start=1)
            if value > 0.0
        )  # fmt: skip
        if marks:
            texts = "; ".join(f"{mark.label}: {mark.title}" for mark in marks)
            alt = f"{what} over processor time by setting. {texts}."
            cost = "processor time, s"
            charts.append(Chart(cost, what, alt, marks=marks, log_x=True, log_y=True))
    return tuple(charts)


def _error_table(errors: Sequence[_Error]) -> Table:
    columns = (
        Column("no."), Column("setting", False), Column("processor time"),
        Column("solidification time, %"), Column("worst cooling curve, %"),
    )  # fmt: skip
    rows = []
    for place, error in enumerate(errors, start=1):
        cost = Cell(seconds(error.cpu_s), str(error.cpu_s))
        off = error.time_percent, error.curve_percent
        rows.append(cells(str(place), error.label, cost, *off))
    return Table(columns, tuple(rows), (False,) * len(rows))


REPORT = KindReport(_pages, _notes)
