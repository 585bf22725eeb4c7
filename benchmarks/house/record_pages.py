"""Write a page for each committed result and the list of all: ``make results-pages``.

What a person found stands in ``docs/results/<study>/README.md`` between the question and the
record; both ends of the page are written from ``record.json`` and the study. The list,
``docs/results/README.md``, takes each answer from its page.
"""

from __future__ import annotations

import json
import re
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path
from typing import Any

import jinja2

from sandmould import ROOT
from sandmould.execution.records import DEFAULTS, RECORDS
from sandmould.module_main import run_main
from sandmould.runs.columns import OUTCOME, RUN, finished
from sandmould.runs.formatting import listed
from sandmould.runs.progress import duration_text
from sandmould.study.collect import read_summary
from sandmould.study.plan.load_study import open_study

RECORD = "## Record\n"
ANSWER = "**Answer.** "
TO_BE_WRITTEN = f"{ANSWER}Not written yet.\n"
THEMES = {
    "Sand fills a tube": ("tube_",),
    "Sand forms a heap": ("repose_", "calibrate_"),
    "Engines and models compared": (
        "engine_", "liggghts_", "wall_", "damping_", "contact_", "rolling_", "frames",
    ),
    "Sand bends foam": ("l_",),
    "A casting freezes": ("plates", "bracket_freezes"),
    "Metal flows": ("tank_", "shoulder_"),
}  # fmt: skip
"""Headings of the list, and how the names of their studies begin."""


@dataclass(frozen=True)
class RecordPage:
    """One committed result."""

    folder: Path

    @property
    def name(self) -> str:
        """Name of the study."""
        return self.folder.name

    @cached_property
    def record(self) -> dict[str, Any]:
        """What ``record.json`` holds."""
        read: dict[str, Any] = json.loads((self.folder / "record.json").read_text("utf-8"))
        return read

    @cached_property
    def question(self) -> str:
        """Title of the study."""
        return open_study(ROOT / self.record["study"]).study.title

    @cached_property
    def found(self) -> str:
        """What a person wrote: the answer, then the rest."""
        page = self.folder / "README.md"
        if not page.is_file():
            return TO_BE_WRITTEN
        text = page.read_text("utf-8").partition(RECORD)[0]
        return text[text.index(ANSWER) :].strip() + "\n"

    @property
    def answer(self) -> str:
        """The first paragraph of what was found, on one line."""
        first = self.found.partition("\n\n")[0].removeprefix(ANSWER)
        return " ".join(first.replace("](../", "](").split())

    @property
    def runs(self) -> str:
        """How many there were, and which failed."""
        summary = read_summary(self.folder)
        bad = summary[~finished(summary)]
        failed = [f"{run} ({why})" for run, why in zip(bad[RUN], bad[OUTCOME], strict=True)]
        return f"{len(summary)}" + (f"; failed: {listed(failed)}" if failed else ", all finished")

    @property
    def took(self) -> str:
        """Wall time of all runs added up."""
        return duration_text(self.record["wall_s_of_all_runs"])

    @property
    def today(self) -> bool:
        """Whether it was computed with the defaults of today."""
        return int(self.record.get("defaults", 1)) == DEFAULTS

    @property
    def machine(self) -> str:
        """On what."""
        machine: dict[str, Any] = self.record["machine"]
        return f"{machine['processor']}, {machine['cores']} cores, {machine['system']}"

    @property
    def engines(self) -> str:
        """Their versions."""
        engines: dict[str, str] = self.record.get("engines", {})
        return ", ".join(f"{name} {version}" for name, version in engines.items())

    @property
    def files(self) -> list[str]:
        """Those of the record, and its figures."""
        names = [path.name for path in self.folder.iterdir() if path.suffix in (".tsv", ".json")]
        figures = [f"figures/{path.name}" for path in (self.folder / "figures").glob("*.*")]
        return [*sorted(names), *sorted(figures)]

    def text(self) -> str:
        """The whole page."""
        return _template("record_page.md.j2").render(page=self, heading=RECORD.strip())


def pages(records: Path = RECORDS) -> list[RecordPage]:
    """All committed results by name."""
    return [RecordPage(path.parent) for path in sorted(records.glob("*/record.json"))]


def by_theme(records: list[RecordPage]) -> dict[str, list[RecordPage]]:
    """Results under their headings; a heading without results is left out."""
    themes = {
        theme: [page for page in records if page.name.startswith(begins)]
        for theme, begins in THEMES.items()
    }
    others = [page for page in records if not any(page in of for of in themes.values())]
    return {theme: of for theme, of in (themes | {"Others": others}).items() if of}


def index_text(records: list[RecordPage]) -> str:
    """The list of all, by theme."""
    return _template("record_list.md.j2").render(themes=by_theme(records))


def _template(name: str) -> jinja2.Template:
    loader = jinja2.FileSystemLoader(Path(__file__).parent)
    environment = jinja2.Environment(
        loader=loader, trim_blocks=True, lstrip_blocks=True, keep_trailing_newline=True,
        undefined=jinja2.StrictUndefined,
    )  # fmt: skip
    environment.filters["cell"] = lambda text: re.sub(r"(?<!\\)\|", r"\\|", text)
    return environment.get_template(name)


def main() -> int:
    """Write all pages and the list."""
    for page in pages():
        (page.folder / "README.md").write_text(page.text(), encoding="utf-8")
    (RECORDS / "README.md").write_text(index_text(pages()), encoding="utf-8")
    return 0


if __name__ == "__main__":
    run_main(main, "python -m benchmarks.house.record_pages")
