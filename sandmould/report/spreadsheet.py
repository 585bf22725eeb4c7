"""The settings and runs of a study as a spreadsheet, in the units of a foundry."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import Any

import pandas as pd
from openpyxl import Workbook
from openpyxl.cell.cell import ILLEGAL_CHARACTERS_RE
from openpyxl.styles import Font
from openpyxl.utils import get_column_letter
from openpyxl.worksheet.worksheet import Worksheet

from sandmould.report.curves import runs_by_setting
from sandmould.runs.files import replaced
from sandmould.runs.formatting import distinct_names, is_number, unit_of
from sandmould.scenario.drive import ACCELERATION, DISPLACEMENT, VELOCITY
from sandmould.scenario.units import ZERO_K
from sandmould.statistics.decision import aims_beside
from sandmould.statistics.verdict import compare_settings
from sandmould.study.collect import read_collected, read_study

_SHOWN = {
    "m": ("mm", 1e3, 0.0), "m/s": ("mm/s", 1e3, 0.0), "m²": ("mm²", 1e6, 0.0),
    "m³": ("mm³", 1e9, 0.0), "K": ("°C", 1.0, -ZERO_K),
}  # fmt: skip
"""The unit shown, factor and offset, of a unit of the tables; others stay as they are."""
_WIDEST = 40


def write_spreadsheet(study_folder: Path, out: Path) -> None:
    """Write a sheet of settings, with means of what they are judged by, and one of all runs.

    Numbers are cells of numbers, whatever the language of the program that opens them.

    ``study_folder``: ``results/<study>`` with its collected tables.

    Raises
    ------
    OSError, ValueError
        When a collected table cannot be read.
    """
    objective, collected = read_study(study_folder).objective, read_collected(study_folder)
    keys, summary = collected.keys, collected.of_sweep.summary
    aims = [objective, *aims_beside(objective.measure, objective.beside, summary)]
    verdicts = [compare_settings(summary, keys, a.measure, a.better).settings for a in aims]
    drive = [each for each in (DISPLACEMENT, VELOCITY, ACCELERATION) if each in summary]
    rows, rows_of = [], runs_by_setting(summary, keys)
    for judged in zip(*verdicts, strict=True):
        first = judged[0]
        moved = rows_of[first.label][drive].mean()
        shown = [_shown(key, first.values[key]) for key in keys]
        shown += [_shown(each, moved[each]) for each in drive]
        for aim, setting in zip(aims, judged, strict=True):
            reach = setting.ci_half_width
            ends = (setting.mean, setting.mean - reach, setting.mean + reach)
            shown += [_shown(aim.measure, each) for each in ends]
        rows.append([*shown, first.n, first.planned])
    stated = [*keys, *drive]
    heads = _heads([*stated, *(aim.measure for aim in aims)])
    means = [
        f"{before}{head}{after}"
        for head in heads[len(stated) :]
        for before, after in (("mean ", ""), ("", ", 95 % from"), ("", ", 95 % to"))
    ]
    book = Workbook()
    settings = book.worksheets[0]
    settings.title = "settings"
    _fill(settings, [*heads[: len(stated)], *means, "runs", "planned"], rows)
    columns = list(map(str, collected.summary.columns))
    every = collected.summary.itertuples(index=False)
    _fill(
        book.create_sheet("runs"),
        _heads(columns),
        [[_shown(*cell) for cell in zip(columns, row, strict=True)] for row in every],
    )
    with replaced(out) as partial:
        book.save(partial)


def _shown(key: str, value: Any) -> Any:
    if not is_number(value):
        return value
    _, factor, offset = _SHOWN.get(unit_of(key), ("", 1.0, 0.0))
    return factor * value + offset


def _heads(keys: Sequence[str]) -> list[str]:
    """Names of columns with the unit shown."""
    names = distinct_names(keys)
    units = {key: _SHOWN.get(unit_of(key), (unit_of(key),))[0] for key in keys}
    return [f"{names[key]}, {units[key]}" if units[key] else names[key] for key in keys]


def _fill(sheet: Worksheet, heads: Sequence[str], rows: Sequence[Sequence[Any]]) -> None:
    """Write a table; a text that begins as a formula stays a text."""
    for place, row in enumerate([heads, *rows], start=1):
        for column, value in enumerate(row, start=1):
            cell = sheet.cell(place, column)
            if is_number(value) or isinstance(value, bool):
                cell.value = None if pd.isna(value) else float(f"{float(value):.12g}")
            elif isinstance(value, str):
                cell.value = ILLEGAL_CHARACTERS_RE.sub("", value)
                cell.data_type = "s"
    for column, head in enumerate(heads, start=1):
        sheet.cell(1, column).font = Font(bold=True)
        sheet.column_dimensions[get_column_letter(column)].width = min(len(head) + 3, _WIDEST)
    sheet.freeze_panes = "A2"
