"""The report's section on settings that should agree: table, intervals against margins, speeds."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

import pandas as pd

from sandmould.definition.study import Study
from sandmould.drawing.chart import PLAIN, Chart, Mark, Tint
from sandmould.report.tables import Cell, Column, Table, cells, number_cell
from sandmould.runs.formatting import listed, name_of, number, seconds, titled
from sandmould.statistics.agreement import Compared, interval_text, speeds
from sandmould.statistics.equivalence import PERCENT
from sandmould.study.collect import Collected, compare_study
from sandmould.wording.agreement import agreement_sentences

_TINTS = {
    "equivalent": Tint("#00694b", "#5fd0a5"),
    "different": Tint("#b3261e", "#ff9d94"),
    "not resolved": Tint("#9a5b00", "#f0b35a"),
}
_LONGEST = 40
"""Characters of a row's name that a phone's width takes."""


@dataclass(frozen=True)
class AgreementPages:
    """What the section shows."""

    sentences: tuple[str, ...]
    sound: bool
    """Whether all settings agree within the margins."""
    is_question: bool
    """Whether the study was made to compare, so that its report begins with the answer."""
    table: Table
    charts: tuple[Chart, ...]
    """One a measure."""
    speeds: Table | None
    """Only where several engines computed."""
    percent: str
    over: str
    """Keys that comparisons are averaged over; empty where none is."""


def agreement_pages(collected: Collected, study: Study) -> AgreementPages | None:
    """Draw the comparisons of a study; None where it compares nothing."""
    compared = compare_study(collected.summary, collected.keys, study)
    if not compared:
        return None
    return AgreementPages(
        sentences=agreement_sentences(compared),
        sound=all(c.agreement.verdict == "equivalent" for c in compared),
        is_question=bool(study.equivalence.keys),
        table=_table(compared),
        charts=tuple(_chart([c for c in compared if c.measure == m])
                     for m in dict.fromkeys(c.measure for c in compared)),
        speeds=_speed_table(collected.summary),
        percent=PERCENT,
        over=listed([name_of(key) for key in study.equivalence.over]),
    )  # fmt: skip


def _table(compared: Sequence[Compared]) -> Table:
    columns = (
        Column("measure", False),
        Column("compared", False),
        *map(Column, ("first", "second", "difference", f"{PERCENT} interval", "margin", "n")),
        Column("verdict", False),
    )
    rows = []
    for c in compared:
        of = c.agreement
        what = Cell(name_of(c.measure), c.measure), f"{c.pair}, {c.at}" if c.at else c.pair
        means = (*(number_cell(mean, 4) for mean in of.means), number_cell(of.difference, 2))
        interval = Cell(interval_text(of), str(of.ci[0]))
        margin = Cell(f"±{of.margin:g}", str(of.margin))
        n = Cell(f"{of.n}{' pairs' if of.paired else ''}", str(of.n))
        verdict = Cell(of.verdict, of.verdict, note=of.note)
        rows.append(cells(*what, *means, interval, margin, n, verdict))
    marked = tuple(c.agreement.verdict != "equivalent" for c in compared)
    return Table(columns, tuple(rows), marked)


def _chart(compared: Sequence[Compared]) -> Chart:
    """Intervals of one measure in rows, with the margins shaded."""
    margin = compared[0].agreement.margin
    marks, said = [], []
    for row, c in enumerate(compared):
        of, apart = c.agreement, number(c.agreement.difference, 2)
        where = f"{c.pair}{f' at {c.at}' if c.at else ''}"
        said.append(f"{where}: {apart}, {interval_text(of)}, {of.verdict}")
        if math.isfinite(of.difference):
            tint, reach = _TINTS.get(of.verdict, PLAIN), (of.ci[1] - of.ci[0]) / 2
            title = f"{c.pair}: {apart}, {of.verdict}"
            marks.append(Mark(of.difference, row, "mean", tint, reach, title))
    what = titled(compared[0].measure)
    return Chart(
        f"difference in {what}",
        "",
        f"Differences in {what} against a margin of {margin:g}. {'; '.join(said)}.",
        marks=tuple(marks),
        rows=tuple(row_name(c) for c in compared),
        band=(-margin, margin),
    )


def row_name(compared: Compared) -> str:
    """Name of a pair with its verdict, short enough for a phone."""
    name = f"{compared.pair}, {compared.at}" if compared.at else compared.pair
    if len(name) > _LONGEST and compared.at:
        name = f"{compared.pair}, {compared.at_values}"
    name = name if len(name) <= _LONGEST else f"{name[: _LONGEST - 1]}…"
    return f"{name}: {compared.agreement.verdict}"


def _speed_table(summary: pd.DataFrame) -> Table | None:
    rows = speeds(summary)
    if len(rows) < 2:
        return None
    columns = (
        Column("engine", False),
        *map(Column, ("version", "runs", "grain-steps/s, median", "wall time a run, median",
                      "speed over the slowest")),
    )  # fmt: skip
    slowest = min(s.grain_steps_per_s for s in rows)
    shown = []
    for s in rows:
        speed = Cell(f"{number(s.grain_steps_per_s / 1e6)} M", str(s.grain_steps_per_s))
        wall, over = Cell(seconds(s.wall_s), str(s.wall_s)), s.grain_steps_per_s / slowest
        shown.append(cells(s.engine, s.version, str(s.runs), speed, wall, number_cell(over, 2)))
    return Table(columns, tuple(shown), (False,) * len(shown))
