"""Tables of the report: key numbers, settings against the best, and every run with its cost."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any
from urllib.parse import quote

import pandas as pd

from sandmould.drawing.thinning import listed_note, listed_runs, listed_settings
from sandmould.runs import columns
from sandmould.runs.columns import CPU_S, OUTCOME, REPLICATE, RUN, SEED, WALL_S, finished, total_s
from sandmould.runs.formatting import (
    OF_BED,
    display_scale,
    filled_space,
    is_number,
    number,
    seconds,
    size,
    with_margin,
)
from sandmould.runs.outcome import Outcome
from sandmould.scenario.drive import BoxDrive
from sandmould.statistics.agreement import sweep_part
from sandmould.statistics.evidence import NOT_FINISHED, left_out
from sandmould.statistics.verdict import Verdict
from sandmould.study.plan.plan_files import (
    CHECKS,
    CURVES,
    FIGURES,
    SPREADSHEET,
    STUDY_FILE,
    SUMMARY,
)
from sandmould.wording.answer import why_unused


@dataclass(frozen=True)
class KeyNumber:
    """A number that a reader looks for first."""

    value: str
    label: str
    note: str = ""


@dataclass(frozen=True)
class ReportPicture:
    """A picture of a page with what it shows."""

    address: str
    """A ``data:`` address."""
    alt: str
    caption: str


@dataclass(frozen=True)
class Cell:
    """What a cell shows and what it is sorted by."""

    text: str
    sort: str
    href: str = ""
    note: str = ""


@dataclass(frozen=True)
class Column:
    """Head of a column."""

    title: str
    is_number: bool = True


@dataclass(frozen=True)
class Table:
    """Heads and rows; a row is marked where something in it needs a look."""

    columns: tuple[Column, ...]
    rows: tuple[tuple[Cell, ...], ...]
    marked: tuple[bool, ...]
    note: str = ""
    """What it leaves out."""


def share_of_what_fits(
    summary: pd.DataFrame, measure: str, values: Mapping[str, Any] | None = None
) -> float:
    """How much of what a tube or cavity could hold is in it, as the mean of finished runs.

    ``measure``: the fill of that space; ``values``: a setting, all together unless given. 1 where
    it is packed as densely as the bed; NaN where runs do not tell.
    """
    column = filled_space(measure) + OF_BED
    if column not in summary:
        return math.nan
    at = sweep_part(summary[finished(summary)])
    for key, value in (values or {}).items():
        at = at[at[key] == value]
    return float(at[column].mean())


def key_numbers(summary: pd.DataFrame) -> tuple[KeyNumber, ...]:
    """Runs that finished, size, cost and health of the runs, as far as their data are there."""
    numbers: list[KeyNumber] = []
    complete = summary[finished(summary)]
    checks = columns.PART in summary and (summary[columns.PART] != columns.SWEEP).any()
    label = "runs finished, checks included" if checks else "runs finished"
    numbers.append(KeyNumber(f"{len(complete)} of {len(summary)}", label))
    # a run that failed may have stopped before it had all its grains
    typical = complete if len(complete) else summary
    for what in ("grains", "elements", "particles"):
        count = _total(typical, what, "median")
        if count is not None:
            count_text = f"{count:,.0f}".replace(",", "\u202f")
            # the deck of a user may lose some
            where = "in a run" if typical[what].nunique() == 1 else "at the end of the median run"
            numbers.append(KeyNumber(count_text, f"{what} {where}"))
    wall_s, cpu_s = total_s(summary, WALL_S), total_s(summary, CPU_S)
    if wall_s > 0.0:
        fills = summary[columns.FILL].nunique() if columns.FILL in summary else 0
        added_up = f"all runs and {fills} shared fills added up" if fills else "all runs added up"
        note = f"{seconds(cpu_s)} of processor time" if cpu_s > 0.0 else ""
        numbers.append(KeyNumber(seconds(wall_s), f"computing, {added_up}", note))
    speed = _total(typical, columns.GRAIN_STEPS_PER_S, "median")
    if speed is not None:
        numbers.append(KeyNumber(f"{number(speed / 1e6)} M", "grain-steps a second, median run"))
    overlap = _total(summary, columns.LARGEST_OVERLAP_FRACTION, "max")
    if overlap is not None:
        numbers.append(KeyNumber(f"{100 * overlap:.1f} %", "largest overlap, of a radius"))
    return tuple(numbers)


def _total(summary: pd.DataFrame, column: str, how: str) -> float | None:
    if column not in summary:
        return None
    value = float(pd.to_numeric(summary[column], errors="coerce").dropna().agg(how))
    return value if math.isfinite(value) and value else None


def settings_table(verdict: Verdict, drives: Mapping[str, BoxDrive]) -> Table:
    """Every setting with its mean, lengths in mm, and the best against it where one is sought.

    ``drives``: that of the vibrating table at a setting, by label.
    """
    drive = ("amplitude, mm", "velocity, mm/s", "accel., g") if drives else ()
    (factor, named), seeks_best = display_scale(verdict.measure), verdict.better != "neither"
    by_factor = verdict.by_factor
    of_apart = 1.0 if by_factor else factor
    of_best = (
        *map(Column, (f"best {'over' if by_factor else 'minus'} this", "95 % interval", "p")),
        Column("beside the best", False),
    )
    heads = (
        Column("setting", False),
        Column(f"{named}, mean ± 95 %"),
        *(of_best if seeks_best else ()),
        *map(Column, ("sd", "runs", *drive)),
    )
    rows, marked = [], []
    for place, setting in enumerate(listed_settings(verdict)):
        against = verdict.against(setting)
        is_best = verdict.best is not None and setting.label == verdict.best.label
        interval, p, difference = "–", math.nan, math.nan
        standing = "best mean" if is_best else "no run"
        if against is not None:
            difference, p = of_apart * against.difference, against.p
            standing = "not tested"
            if against.tested:
                low, high = (number(of_apart * end, 2) for end in against.ci)
                interval = f"{low} to {high}"
                standing = "worse" if against.separated else "no clear difference"
        beside_best = (
            number_cell(difference, 2),
            Cell(interval, str(difference)),
            Cell(_p_text(p), str(p)),
            Cell(standing, standing),
        )
        mean, half_width = factor * setting.mean, factor * setting.ci_half_width
        rows.append(
            (
                Cell(setting.label, str(place)),
                Cell(with_margin(mean, half_width), str(setting.mean)),
                *(beside_best if seeks_best else ()),
                number_cell(factor * setting.sd, 2),
                Cell(f"{setting.n} of {setting.planned}", str(setting.n)),
                *(number_cell(x) for x in _amplitudes(drives.get(setting.label)) if drives),
            )
        )
        marked.append(is_best and seeks_best)
    nearest = "the best and those that come nearest to it"
    note = listed_note(len(rows), len(verdict.settings), "settings", nearest)
    return Table(heads, tuple(rows), tuple(marked), note)


def _p_text(p: float) -> str:
    if not math.isfinite(p):
        return "–"
    return "< 0.001" if p < 0.001 else f"{p:.3f}"


def _amplitudes(drive: BoxDrive | None) -> tuple[float, ...]:
    """Of displacement and velocity in mm and mm/s, of acceleration in g."""
    if drive is None:
        return (math.nan,) * 3
    return 1e3 * drive.displacement_m, 1e3 * drive.velocity_m_s, drive.acceleration_g


def number_cell(value: float, digits: int = 3) -> Cell:
    """A number with so many digits, sorted by its value."""
    return Cell(number(value, digits), str(value))


def cells(*values: str | float | Cell) -> tuple[Cell, ...]:
    """A row, or a part of it: texts are sorted as they stand, numbers by their value."""
    return tuple(map(_cell, values))


def _cell(value: str | float | Cell) -> Cell:
    if isinstance(value, Cell):
        return value
    return Cell(value, value) if isinstance(value, str) else number_cell(float(value))


_COST = (
    (columns.GRAINS, "grains", lambda v: f"{v:.0f}"),
    ("elements", "elements", lambda v: f"{v:.0f}"),
    ("particles", "particles", lambda v: f"{v:.0f}"),
    (columns.SIMULATED_S, "simulated", seconds),
    (WALL_S, "wall time", seconds),
    (CPU_S, "processor time", seconds),
    (columns.FILL_CPU_S, "share of its fill", seconds),
    (columns.GRAIN_STEPS_PER_S, "grain-steps/s", lambda v: f"{number(v / 1e6)} M"),
    ("element_steps_per_s", "element-steps/s", lambda v: f"{number(v / 1e6)} M"),
    ("particle_solves_per_s", "particle-solves/s", lambda v: f"{number(v / 1e6)} M"),
    ("solver_fraction", "time in the solver", lambda v: f"{100 * v:.0f} %"),
    (columns.PEAK_MEMORY_BYTES, "memory", size),
    (columns.TIME_STEP_FRACTION, "step / critical", number),
    (columns.LEAST_LIMIT_S, "least exact limit", lambda v: f"{number(1e6 * v)} µs"),
    (columns.LARGEST_OVERLAP_FRACTION, "largest overlap", lambda v: f"{100 * v:.1f} %"),
)


def runs_table(
    summary: pd.DataFrame, keys: Sequence[str], verdict: Verdict, runs_href: str
) -> Table:
    """Every run with its parameters, outcome, objective and cost; why one is left out is said."""
    cost = [c for c in _COST if c[0] in summary]
    blocks = [c for c in (REPLICATE, SEED) if c in summary]
    measured = [verdict.measure] if verdict.measure in summary else []
    heads = (
        Column("run", False),
        *(Column(display_scale(k)[1]) for k in keys),
        *(Column(b) for b in blocks),
        Column("outcome", False),
        *(Column(display_scale(m)[1]) for m in measured),
        *(Column(title) for _, title, _ in cost),
    )
    rows, marked = [], []
    listed = listed_runs(summary, verdict)
    reasons = left_out(listed, verdict.measure)
    for row, why in zip(listed.to_dict("records"), reasons, strict=True):
        rows.append(
            (
                Cell(
                    str(row[RUN]),
                    str(row[RUN]),
                    f"{runs_href}/{quote(str(row[RUN]))}/",
                ),
                *(_parameter_cell(row[k], display_scale(k)[0]) for k in keys),
                *(_parameter_cell(row[b]) for b in blocks),
                Cell(str(row[OUTCOME]), str(row[OUTCOME]), note=_why(row, why)),
                *(number_cell(display_scale(m)[0] * _float(row[m]), 4) for m in measured),
                *(_cost_cell(row[name], show) for name, _, show in cost),
            )
        )
        marked.append(bool(why))
    failed_and_best = "those without a value and then the best; summary.tsv has all"
    note = listed_note(len(rows), len(summary), "runs", failed_and_best)
    return Table(heads, tuple(rows), tuple(marked), note)


def _parameter_cell(value: Any, factor: float = 1.0) -> Cell:
    if factor != 1.0 and is_number(value):
        value = factor * float(value)
    text = f"{value:.6g}" if isinstance(value, float) else str(value)
    return Cell(text, str(value))


def _cost_cell(value: Any, show: Any) -> Cell:
    x = _float(value)
    return Cell(show(x) if math.isfinite(x) else "–", str(x))


def _float(value: Any) -> float:
    try:
        return float(value)
    except (TypeError, ValueError):
        return math.nan


def _why(row: Mapping[Any, Any], why: str) -> str:
    """Why a run is left out, with what the engine or the collection said."""
    detail = row[columns.DETAIL] if isinstance(row[columns.DETAIL], str) else ""
    code = _float(row[columns.OUTCOME_CODE])
    if why != NOT_FINISHED:
        meaning = f"{why_unused(why).capitalize()}." if why else ""
    elif math.isfinite(code):
        meaning = Outcome(int(code)).meaning
    else:
        meaning = "The run was not started, or was killed before it could say how it ended."
    return " ".join(s for s in (meaning, detail) if s)


_FILES = (
    (STUDY_FILE, "the study as planned"),
    ("runs.tsv", "the plan: every run, its parameters, replicate and seed"),
    (SUMMARY, "one row per run of the sweep: parameters, outcome, final measures, cost"),
    (CURVES, "one row per snapshot of the sweep: all measures against time"),
    (SPREADSHEET, "settings and runs in mm, Hz, g and °C"),
    (CHECKS[0], "the runs that check the sweep, on another engine or as controls: one row per run"),
    (CHECKS[1], "the same runs: one row per snapshot"),
    (FIGURES, "main figures as files: charts as SVG, sand as PNG"),
    ("agreement.tsv", "one row per compared pair of settings and measure"),
    ("runs", "one folder per run: scenario, deck, outcome, provenance, time series, wall loads, "
     "snapshots; sandmould export RUN adds some for ParaView (.vtu) and OVITO (.dump)"),
)  # fmt: skip


def data_files(study_folder: Path, base_href: str) -> tuple[dict[str, str], ...]:
    """Files of the study that are there, with addresses seen from the report."""
    return tuple(
        {"href": f"{base_href}{name}", "name": name, "what": what}
        for name, what in _FILES
        if (study_folder / name).exists()
    )
