"""The page on how far the engines agree, from the committed results: ``docs/engine_twins.md``.

Refresh it with ``python -m benchmarks.twins``; ``make twins`` computes the studies too.
"""

from __future__ import annotations

import json
import sys
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import pandas as pd
from jinja2 import Environment, FileSystemLoader, StrictUndefined

from sandmould import ROOT
from sandmould.runs.formatting import name_of, number, seconds
from sandmould.statistics.agreement import (
    Compared,
    Speed,
    agreement_sentences,
    interval_text,
    speeds,
)
from sandmould.study.collect import compare_study, swept_keys
from sandmould.study.load_study import open_study
from sandmould.study.records import RECORDS

PAGE = ROOT / "docs" / "engine_twins.md"
TEMPLATES = ROOT / "templates" / "docs"
TWINS = "engine_twins"
EFFECTS = ("damping_forms", "contact_readings", "rolling_axes", "frames")
"""Studies that measure one difference at a time, by the same machinery."""


@dataclass(frozen=True)
class Recorded:
    """A committed study and what it compared."""

    name: str
    title: str
    replicates: int
    confidence: float
    record: dict[str, Any]
    keys: tuple[str, ...]
    """Keys whose values are compared."""
    compared: tuple[Compared, ...]
    speeds: tuple[Speed, ...]

    @property
    def sentences(self) -> tuple[str, ...]:
        """Whether its settings agree."""
        return agreement_sentences(self.compared, self.confidence)


def read_recorded(folder: Path) -> Recorded:
    """Judge a committed study again, by the margins of its file.

    Raises
    ------
    OSError
        When the folder holds no whole record.
    """
    record = json.loads((folder / "record.json").read_text(encoding="utf-8"))
    study = open_study(ROOT / record["study"]).study
    summary = pd.read_csv(folder / "summary.tsv", sep="\t", dtype={"run": str, "version": str})
    keys = swept_keys(pd.read_csv(folder / "runs.tsv", sep="\t"))
    return Recorded(
        folder.name,
        study.title,
        study.replicates,
        study.equivalence.confidence,
        record,
        study.equivalence.keys,
        compare_study(summary, keys, study),
        speeds(summary),
    )


def page_text(records: Path = RECORDS) -> str:
    """Write the page from the committed results.

    Raises
    ------
    SystemExit
        Naming the studies that have no record yet.
    """
    names = (TWINS, *EFFECTS)
    missing = [name for name in names if not (records / name / "record.json").is_file()]
    if missing:
        raise SystemExit(f"no record of {', '.join(missing)} in {records}: make twins")
    twins, *effects = (read_recorded(records / name) for name in names)
    template = environment().get_template("engine_twins.md.j2")
    return template.render(twins=twins, effects=effects)


def environment() -> Environment:
    """Templates of the documentation's pages, with the words that they use."""
    made = Environment(
        loader=FileSystemLoader(TEMPLATES),
        undefined=StrictUndefined,
        trim_blocks=True,
        lstrip_blocks=True,
        keep_trailing_newline=True,
    )
    made.globals = {
        **made.globals,
        "number": number,
        "seconds": seconds,
        "name_of": name_of,
        "interval_text": interval_text,
    }
    return made


def main() -> int:
    """Rewrite the page."""
    PAGE.write_text(page_text(), encoding="utf-8")
    print(PAGE.relative_to(ROOT))
    return 0


if __name__ == "__main__":
    sys.exit(main())
