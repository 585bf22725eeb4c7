"""Numbers of ours from committed records, results of benchmarks and scenarios."""

from __future__ import annotations

import difflib
import json
import math
import re
from collections.abc import Iterator
from dataclasses import dataclass, field
from functools import cached_property
from pathlib import Path
from typing import Any

import pandas as pd

from benchmarks.reproduction.ledger import OurSource
from benchmarks.reproduction.our_number import OurNumber, less, over, taken
from sandmould import ROOT
from sandmould.bad_input import BadInputError, Problem
from sandmould.casting import arpm, mps
from sandmould.execution.records import RECORDS, why_stale
from sandmould.kinds.registry import kind_named
from sandmould.runs.columns import finished
from sandmould.runs.formatting import listed
from sandmould.scenario.reading import read_yaml
from sandmould.statistics.agreement import sweep_part
from sandmould.study.collect import read_summary, swept_keys
from sandmould.study.plan.expand import expand
from sandmould.study.plan.fills import share_fills
from sandmould.study.plan.load_study import OpenStudy, open_study
from sandmould.study.plan.price import Prices

STUDIES = ROOT / "config" / "studies"
MATERIALS = ROOT / "config" / "materials"
BENCHMARKS = ROOT / "benchmarks"
SOLVERS = {"arpm": arpm.source_hash, "mps": mps.source_hash}
"""State of the solver that a theme of benchmarks measures."""
_NUMBER = re.compile(r"[-−+]?\d+(?:\.\d+)?")


@dataclass(frozen=True)
class StudyRecord:
    """A committed record: its table, its texts and whether it stands."""

    name: str
    folder: Path
    record: dict[str, Any]

    @cached_property
    def summary(self) -> pd.DataFrame:
        """Runs of the sweep, failed ones included."""
        return sweep_part(read_summary(self.folder))

    @cached_property
    def stale(self) -> str:
        """What is wrong with it; empty where it stands."""
        return why_stale(self.folder)

    @cached_property
    def readme_tables(self) -> pd.DataFrame:
        """Tables of what was found, in the record's README, one row a line."""
        text = (self.folder / "README.md").read_text(encoding="utf-8")
        return pd.DataFrame(list(table_rows(text.partition("\n## Record\n")[0])))

    @property
    def study(self) -> str:
        """Name of its study, as the command takes it."""
        return Path(self.record["study"]).stem

    @property
    def took_s(self) -> float:
        """Wall time of all runs."""
        return float(self.record["wall_s_of_all_runs"])


def table_rows(text: str) -> Iterator[dict[str, str]]:
    """Rows of all Markdown tables of a text, by the heads of their columns."""
    head: list[str] = []
    for line in text.splitlines():
        cells = [cell.strip() for cell in line.strip().strip("|").split("|")]
        if not line.startswith("|"):
            head = []
        elif not head:
            head = cells
        elif set(line) - set("|-: "):
            yield dict(zip(head, cells, strict=False))


@dataclass
class RecordedNumbers:
    """All that the page refers to, each read once."""

    records: Path = RECORDS
    benchmarks: Path = BENCHMARKS
    read: dict[str, StudyRecord] = field(default_factory=dict)
    """Records that were asked for, by name."""
    _results: dict[str, Any] = field(default_factory=dict)
    _scenarios: dict[str, Any] = field(default_factory=dict)

    def number(self, source: OurSource, file: str, key: str) -> OurNumber:
        """Take a number from where a row says that it is.

        Parameters
        ----------
        source : OurSource
        file, key : str
            Where the row stands, for messages.

        Raises
        ------
        BadInputError
            Where there is no such record, part, column, row or number.
        """
        if source.scenario or source.material:
            value = self._key_of(source, file, key)
            found = OurNumber(value, value, value, 1)
        else:
            found = taken(self._rows(source, file, key), source)
        if source.minus is not None:
            found = less(found, self.number(source.minus, file, f"{key}.minus"))
        if source.over is not None:
            found = over(found, self.number(source.over, file, f"{key}.over"))
        if not math.isfinite(found.best):
            raise _bad(file, f"{key}.over", source.column, "what is not 0")
        low, high = sorted((found.low * source.times, found.high * source.times))
        return OurNumber(low, high, found.best * source.times, found.n, found.cost_s)

    def record_of(self, name: str, file: str, key: str) -> StudyRecord:
        """Read a record once.

        Raises
        ------
        BadInputError
            Where there is none of this name.
        """
        if name not in self.read:
            folder = self.records / name
            if not (folder / "record.json").is_file():
                has = sorted(path.parent.name for path in self.records.glob("*/record.json"))
                raise _bad(file, key, name, f"a folder of docs/results{_near(name, has)}")
            record = json.loads((folder / "record.json").read_text(encoding="utf-8"))
            self.read[name] = StudyRecord(name, folder, record)
        return self.read[name]

    def results_of(self, theme: str) -> Any:
        """Read the results of a theme of benchmarks once."""
        if theme not in self._results:
            text = (self.benchmarks / theme / "results.json").read_text(encoding="utf-8")
            self._results[theme] = json.loads(text)
        return self._results[theme]

    def _rows(self, source: OurSource, file: str, key: str) -> pd.DataFrame:
        """Rows that a source counts, with its column."""
        if source.results:
            table = self._part(source, file, key)
        else:
            record = self.record_of(source.record, file, f"{key}.record")
            table = record.readme_tables if source.in_readme else record.summary
            if source.in_readme and not len(table):
                raise _bad(file, f"{key}.record", source.record, "a record with a table in README")
        for column in (*source.where, source.column, *([source.of] if source.of else [])):
            if column not in table:
                has = [str(name) for name in table.columns]
                place = source.record or f"{source.part} of {source.results}"
                valid = f"a column of {place}{_near(column, has)}"
                raise _bad(file, f"{key}.column", column, valid)
        for column, value in source.where.items():
            cells = value if isinstance(value, list) else [value]
            table = table[[any(_is(cell, each) for each in cells) for cell in table[column]]]
            if not len(table):
                valid = f"a value of {column} in that table"
                raise _bad(file, f"{key}.where.{column}", value, valid)
        if source.in_readme:
            numbers = [_first_number(cell) for cell in table[source.column]]
            table = table.assign(**{source.column: numbers})
        elif source.record:
            table = table[finished(table)]
        if not _are_numbers(table[source.column]):
            valid = "a column with numbers in these rows"
            raise _bad(file, f"{key}.column", source.column, valid)
        if source.take == "mean":
            _one_setting(table, source, file, key)
        return table

    def _part(self, source: OurSource, file: str, key: str) -> pd.DataFrame:
        part = self.results_of(source.results)
        for name in source.part.split("."):
            if not isinstance(part, dict) or name not in part:
                has = list(part) if isinstance(part, dict) else []
                valid = f"a path into the results{_near(name, has)}"
                raise _bad(file, f"{key}.part", source.part, valid)
            part = part[name]
        table = pd.json_normalize(part)
        # Cells that are lists, such as a course over time, are as many rows.
        asked = dict.fromkeys((source.column, *source.where))
        lists = [
            c for c in asked if c in table and any(isinstance(cell, list) for cell in table[c])
        ]
        return table.explode(lists) if lists else table

    def _key_of(self, source: OurSource, file: str, key: str) -> float:
        """Value of a key in the scenario of a shipped study, or in a material."""
        name = source.scenario or source.material
        if source.scenario:
            value = self._scenario(name, file, f"{key}.scenario")
        else:
            path = MATERIALS / f"{name}.yaml"
            if not path.is_file():
                has = sorted(each.stem for each in MATERIALS.glob("*.yaml"))
                valid = f"a file of config/materials{_near(name, has)}"
                raise _bad(file, f"{key}.material", name, valid)
            value = read_yaml(path, path.name)
        for part in source.column.split("."):
            try:
                value = value[int(part)] if isinstance(value, list) else value[part]
            except (LookupError, TypeError, ValueError):
                has = list(value) if isinstance(value, dict) else []
                valid = f"a key of {name}{_near(part, has)}"
                raise _bad(file, f"{key}.column", source.column, valid) from None
        if isinstance(value, dict):
            value = value.get("value")
        if isinstance(value, bool) or not isinstance(value, int | float):
            raise _bad(file, f"{key}.column", source.column, f"a key with a number, not {value!r}")
        return float(value)

    def _scenario(self, study: str, file: str, key: str) -> Any:
        """Scenario of the first run of a shipped study, resolved once."""
        if study not in self._scenarios:
            scene = expand(shipped(study, file, key))[0].scenario
            self._scenarios[study] = scene.model_dump(mode="json")
        return self._scenarios[study]


def shipped(name: str, file: str, key: str) -> OpenStudy:
    """Open a shipped study by its name.

    Raises
    ------
    BadInputError
        Where none has this name.
    """
    path = STUDIES / f"{name}.yaml"
    if not path.is_file():
        has = sorted(p.stem for p in STUDIES.glob("*.yaml"))
        raise _bad(file, key, name, f"a study of config/studies{_near(name, has)}")
    return open_study(path)


def planned_core_s(study: OpenStudy) -> float:
    """Time that a study would take one core, s, at speeds that are the same on every machine."""
    runs, fills = share_fills(expand(study), kind_named(study.study.kind).planning)
    return sum(Prices().engine_s(run) for run in (*fills, *runs))


def _one_setting(rows: pd.DataFrame, source: OurSource, file: str, key: str) -> None:
    """Refuse a mean over rows that differ in more than chance."""
    if source.record and not source.in_readme:
        several = [name for name in swept_keys(rows) if rows[name].astype(str).nunique() > 1]
    else:
        several = [str(name) for name in rows] if len(rows) > 1 else []
    if several:
        valid = f"rows of one setting, by {listed(several)} as well"
        raise _bad(file, f"{key}.where", source.where, valid)


def _is(cell: Any, value: Any) -> bool:
    try:
        return math.isclose(float(cell), float(value), rel_tol=1e-9)
    except (TypeError, ValueError):
        return str(cell) == str(value)


def _are_numbers(cells: pd.Series[Any]) -> bool:
    """Whether all cells are numbers or gaps, and not all gaps."""
    numbers = pd.to_numeric(cells, errors="coerce").notna()
    return bool(numbers.eq(cells.notna()).all() and numbers.any())


def _first_number(cell: Any) -> float:
    found = _NUMBER.search(str(cell))
    return float(found[0].replace("−", "-")) if found else math.nan


def _near(name: str, has: list[str]) -> str:
    near = difflib.get_close_matches(name, has, n=3, cutoff=0.4)
    return f", nearest {', '.join(near)}" if near else ""


def _bad(file: str, key: str, value: Any, valid: str) -> BadInputError:
    return BadInputError([Problem(key, value, valid, file)])
