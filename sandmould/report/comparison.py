"""Finished studies side by side: a table, a picture and a page of several studies."""

from __future__ import annotations

import json
import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from pathlib import Path
from typing import Any

import numpy as np

from sandmould.bad_input import BadInputError, Problem
from sandmould.definition.study import Study
from sandmould.definition.sweep import value_at
from sandmould.drawing.chart import NARROW, WIDE, Chart, Line, Mark, lay_out, tints
from sandmould.drawing.figure_files import page_environment
from sandmould.report.tables import Cell, Column, Table
from sandmould.runs.files import write_text
from sandmould.runs.formatting import (
    display_range,
    display_scale,
    is_number,
    listed,
    name_of,
    runs_text,
    titled,
    with_margin,
)
from sandmould.statistics.mean_tests import CONFIDENCE, MeanTest, welch
from sandmould.statistics.settings import WIDE_KEY, Setting, is_wide, spans
from sandmould.statistics.verdict import FEW, compare_settings
from sandmould.study.collect import Collected, read_collected, read_study
from sandmould.study.plan.plan_files import SUMMARY, VERDICT_FILE

BESIDE = ("part_solidification_time_s", "cut_off_fraction", "low_niyama_fraction")
"""Measures that are shown beside the objective, where all studies have them."""
_LEFT_OUT = ("title", "based_on", "sweep")
_MOST_DIFFERENCES = 60
_LONGEST = 60
"""Letters of a value that is written out."""


@dataclass(frozen=True)
class ComparedStudy:
    """One of the studies."""

    name: str
    folder: Path
    study: Study
    collected: Collected
    verdict: str
    """The first sentence of its report."""
    keys: tuple[str, ...]
    """What its settings are told by: what it sweeps, and what others do of which it has a value."""

    def settings(self, measure: str) -> tuple[Setting, ...]:
        """Means of a measure at its settings."""
        summary = self.collected.of_sweep.summary
        others = [key for key in self.keys if key not in self.collected.keys]
        fixed = {key: self.fixed(key) for key in others}
        # as tables have them
        fixed |= {key: json.dumps(v) for key, v in fixed.items() if isinstance(v, list | dict)}
        return compare_settings(summary.assign(**fixed), self.keys, measure).settings

    def fixed(self, key: str) -> Any:
        """Value of a key that it does not sweep.

        Raises
        ------
        KeyError
            Where it has none.
        """
        return value_at(self.study.scenario.model_dump(mode="json"), key)

    @cached_property
    def stated(self) -> dict[str, Any]:
        """What the study states, by key path."""
        tree = self.study.model_dump(mode="json")
        return dict(_leaves({k: v for k, v in tree.items() if k not in _LEFT_OUT}))


def _leaves(tree: Any, above: str = "") -> Iterator[tuple[str, Any]]:
    inner = tree.items() if isinstance(tree, dict) else enumerate(tree)
    for name, value in inner:
        key = f"{above}.{name}" if above else str(name)
        if isinstance(value, dict | list) and value:
            yield from _leaves(value, key)
        else:
            yield key, value


@dataclass(frozen=True)
class SideBySide:
    """What is said of studies that have a measure in common."""

    measure: str
    studies: tuple[ComparedStudy, ...]

    @cached_property
    def _settings(self) -> list[dict[str, Setting]]:
        return [{s.label: s for s in each.settings(self.measure)} for each in self.studies]

    @cached_property
    def labels(self) -> list[str]:
        """Settings of all studies, in rising order where they are numbers of one key."""
        values = {s.label: s.values for one in self._settings for s in one.values()}
        keys = {tuple(at) for at in values.values()}
        is_one = len(keys) == 1 and len(next(iter(keys))) == 1
        if is_one and all(is_number(v) for at in values.values() for v in at.values()):
            return sorted(values, key=lambda label: next(iter(values[label].values())))
        return list(values)

    @property
    def beside(self) -> list[SideBySide]:
        """The same studies by the measures of ``BESIDE``."""
        summaries = [each.collected.of_sweep.summary for each in self.studies]
        known = [it for it in BESIDE if all(it in s and s[it].notna().any() for s in summaries)]
        return [replace(self, measure=it) for it in known if it != self.measure]

    @property
    def has_common_settings(self) -> bool:
        """Whether some setting was computed in two of them."""
        return len(self.labels) < sum(map(len, self._settings))

    @property
    def key(self) -> str:
        """The one key with numbers that all of them sweep; empty where there is none."""
        swept = {each.keys for each in self.studies}
        values = [v for one in self._settings for s in one.values() for v in s.values.values()]
        if len(swept) == 1 and len(key := swept.pop()) == 1 and all(map(is_number, values)):
            return key[0]
        return ""

    def objective_table(self) -> Table:
        """Mean of the objective and its 95 % interval: a row a setting, a column a study."""
        rows = [
            (
                Cell(label, str(place)),
                *(_mean_cell(settings.get(label)) for settings in self._settings),
            )
            for place, label in enumerate(self.labels)
        ]
        columns = [Column("setting", False), *(Column(each.name) for each in self.studies)]
        tested = [self._tested(label) for label in self.labels]
        if len(self.studies) == 2 and any(tested):
            first, second = (each.name for each in self.studies)
            columns.append(Column(f"{second} less {first}, 95 %"))
            rows = [(*row, self._tested_cell(test)) for row, test in zip(rows, tested, strict=True)]
        return Table(tuple(columns), tuple(rows), (False,) * len(rows))

    def _tested(self, label: str) -> MeanTest | None:
        """The second study less the first at one setting, by Welch's test."""
        first, second = (settings.get(label) for settings in self._settings[:2])
        if first is None or second is None or min(first.n, second.n) < 2:
            return None
        return welch(second.mean - first.mean, (first.sd, first.n), (second.sd, second.n))

    def _tested_cell(self, test: MeanTest | None) -> Cell:
        if test is None:
            return Cell("–", "nan")
        ends = test.confidence_interval(CONFIDENCE)
        return Cell(display_range(self.measure, *ends), str(test.difference))

    def differences(self) -> Table:
        """What the studies state differently, but for what they sweep."""
        stated = [each.stated for each in self.studies]
        swept = tuple(f"scenario.{key}" for each in self.studies for key in each.keys)
        keys = [key for key in dict.fromkeys(k for one in stated for k in one)
                if not key.startswith(swept)]  # fmt: skip
        told = [(key, [_value_text(one, key) for one in stated]) for key in keys]
        found = [(key, texts) for key, texts in told if len(set(texts)) > 1]
        rows = [
            (Cell(key, str(place)), *(Cell(text, text) for text in texts))
            for place, (key, texts) in enumerate(found[:_MOST_DIFFERENCES])
        ]
        columns = (Column("key", False), *(Column(each.name, False) for each in self.studies))
        left = len(found) - len(rows)
        note = f"{left} more keys differ; study.yaml of each study has all." if left else ""
        return Table(columns, tuple(rows), (False,) * len(rows), note)

    def chart(self) -> Chart:
        """Means with their intervals, over the swept key or, without a common one, in rows."""
        factor, what = display_scale(self.measure)
        colours = tints(len(self.studies), ordered=False)
        alt = f"Mean {name_of(self.measure)} of {listed([e.name for e in self.studies])}."
        marks: list[Mark] = []
        lines: list[Line] = []
        rows: list[str] = []
        for n, (each, settings) in enumerate(zip(self.studies, self._settings, strict=True)):
            shift_px = 5.0 * (n - (len(self.studies) - 1) / 2)
            points = []
            for label in (label for label in self.labels if label in settings):
                setting = settings[label]
                if not setting.n:
                    continue
                reach = factor * setting.ci_half_width if setting.n >= FEW else math.nan
                mean = with_margin(setting.mean, setting.ci_half_width)
                title = f"{each.name}, {label}: mean {mean}, {runs_text(setting.n)}"
                y = factor * setting.mean
                if self.key:
                    x = float(setting.values[self.key])
                    points.append((x, y))
                    marks.append(Mark(x, y, "mean", colours[n], reach, title, shift_px))
                else:
                    marks.append(Mark(y, len(rows), "mean", colours[n], reach, title))
                    rows.append(f"{each.name}: {label}")
            if points:
                label = each.name
                lines.append(Line(np.array(points), colours[n], "run", label, label))
        every = [s for settings in self._settings for s in settings.values()]
        wide = is_wide(self.measure, every, (s.mean for s in every))
        x_title = titled(self.key) if self.key else what
        ticks = sorted({x for line in lines for x in line.xy[:, 0].tolist()})
        return Chart(
            x_title,
            what if self.key else "",
            alt,
            tuple(lines),
            tuple(marks),
            x_ticks=tuple(ticks) if len(ticks) <= 12 else (),
            rows=tuple(rows),
            log_x=spans(ticks, WIDE_KEY) if self.key else wide,
            log_y=wide and bool(self.key),
        )

    def text(self) -> str:
        """The tables of all that is compared and the verdicts for the terminal."""
        tables = [it._means_text() for it in (self, *self.beside)]
        said = [f"{each.name}: {each.verdict}" for each in self.studies]
        return "\n".join([*tables, *said])

    def _means_text(self) -> str:
        table = self.objective_table()
        rows = [[c.title for c in table.columns], *([c.text for c in row] for row in table.rows)]
        widths = [max(len(row[i]) for row in rows) for i in range(len(rows[0]))]
        lines = ["  ".join(t.ljust(w) for t, w in zip(row, widths, strict=True)).rstrip()
                 for row in rows]  # fmt: skip
        return "\n".join([f"Mean {titled(self.measure)} ± 95 %", "", *lines, ""])


def _mean_cell(setting: Setting | None) -> Cell:
    if setting is None or not setting.n:
        return Cell("–", "nan")
    mean = with_margin(setting.mean, setting.ci_half_width)
    return Cell(f"{mean} ({runs_text(setting.n)})", str(setting.mean))


def _value_text(stated: dict[str, Any], key: str) -> str:
    if key not in stated or stated[key] in (None, [], {}):
        return "–"
    value = stated[key]
    text = f"{value:.9g}" if is_number(value) else str(value)
    return text if len(text) <= _LONGEST else f"{text[:_LONGEST]}…"


def read_comparison(folders: Sequence[Path]) -> SideBySide:
    """Read finished studies.

    ``folders``: their folders of results, at least two. The objective of the first is compared.

    Raises
    ------
    BadInputError
        When one is no finished study, or lacks that measure.
    """
    if len(folders) < 2:
        raise BadInputError([Problem("STUDY", str(*folders), "two studies or more")])
    stems = [folder.resolve().name for folder in folders]
    names = [s if stems.count(s) == 1 else str(f) for s, f in zip(stems, folders, strict=True)]
    studies = _alike(tuple(_read(n, f) for n, f in zip(names, folders, strict=True)))
    measure = studies[0].study.objective.measure
    for each in studies:
        summary = each.collected.of_sweep.summary
        if measure not in summary:
            valid = f"a study with {measure}, which {studies[0].name} is judged by"
            raise BadInputError([Problem("STUDY", each.name, valid)])
    return SideBySide(measure, studies)


def _alike(studies: tuple[ComparedStudy, ...]) -> tuple[ComparedStudy, ...]:
    """Studies whose settings are told by the same keys, where each has a value of all."""
    keys = tuple(dict.fromkeys(key for each in studies for key in each.keys))
    try:
        for each in studies:
            for key in keys:
                each.fixed(key)
    except KeyError:
        return studies
    return tuple(replace(each, keys=keys) for each in studies)


def _read(name: str, folder: Path) -> ComparedStudy:
    if not (folder / SUMMARY).is_file():
        valid = f"a finished study: {folder} has no {SUMMARY}; sandmould run comes first"
        raise BadInputError([Problem("STUDY", name, valid)])
    try:
        study, collected = read_study(folder), read_collected(folder)
        verdict_file = folder / VERDICT_FILE
        said = verdict_file.read_text(encoding="utf-8").strip() if verdict_file.is_file() else "–"
        return ComparedStudy(name, folder, study, collected, said, collected.keys)
    except (OSError, ValueError) as error:
        valid = f"a folder of results that can be read ({error})"
        raise BadInputError([Problem("STUDY", name, valid)]) from error


def write_comparison(comparison: SideBySide, out: Path) -> Path:
    """Write the page, and beside it its picture as SVG."""
    environment = page_environment()
    chart = comparison.chart()
    page = environment.get_template("comparison.html").render(
        names=[each.name for each in comparison.studies],
        studies=comparison.studies,
        measure_name=name_of(comparison.measure),
        sizes=(lay_out(chart, WIDE), lay_out(chart, NARROW)),
        objective=comparison.objective_table(),
        beside={name_of(it.measure): it.objective_table() for it in comparison.beside},
        differences=comparison.differences(),
        common=comparison.has_common_settings,
        key=comparison.key,
        few=FEW,
    )
    write_text(out, page)
    picture = out.with_suffix(".svg")
    figure = environment.get_template("figure.svg").render(laid=lay_out(chart, WIDE))
    write_text(picture, figure)
    return picture
