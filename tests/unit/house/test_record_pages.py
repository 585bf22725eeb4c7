"""Pages of committed results: up to date, each with an answer, and what a person wrote stays."""

from __future__ import annotations

import re
import shutil
from pathlib import Path

import pytest

from benchmarks.house.record_pages import RECORD, RecordPage, index_text, pages
from sandmould import ROOT
from sandmould.execution.records import RECORDS

PAGES = pages()
LARGEST = 5_000_000
"""Bytes of all records."""


@pytest.mark.parametrize("page", PAGES, ids=lambda page: page.name)
def test_it_is_up_to_date_and_answers(page: RecordPage) -> None:
    assert page.text() == (page.folder / "README.md").read_text(encoding="utf-8")
    assert "Not written yet" not in page.answer
    assert len(page.answer) > 20


def test_the_list_is_up_to_date() -> None:
    assert index_text(PAGES) == (RECORDS / "README.md").read_text(encoding="utf-8")


def test_a_new_record_gets_a_page_that_keeps_what_is_written(tmp_path: Path) -> None:
    folder = tmp_path / "tube_demo"
    folder.mkdir()
    for name in ("record.json", "summary.tsv", "summary_checks.tsv"):
        shutil.copy(RECORDS / "tube_demo" / name, folder / name)
    page = folder / "README.md"
    page.write_text(RecordPage(folder).text(), encoding="utf-8")
    assert "**Answer.** Not written yet." in page.read_text(encoding="utf-8")
    written = page.read_text(encoding="utf-8").replace(
        "Not written yet.", "85 Hz\nis best.\n\nSee [the other](../tube_frequency/README.md)."
    )
    page.write_text(written, encoding="utf-8")
    assert RecordPage(folder).text() == written
    assert RecordPage(folder).answer == "85 Hz is best."
    assert "/tube_demo.yaml)): 32, all finished." in written
    assert "| [tube_demo](tube_demo/README.md) |" in index_text([RecordPage(folder)])


def test_records_take_at_most_5_mb() -> None:
    assert sum(path.stat().st_size for path in RECORDS.rglob("*") if path.is_file()) <= LARGEST


def test_a_record_has_the_figures_that_pages_show_and_no_others() -> None:
    shown = set()
    for page in (ROOT / "README.md", *(ROOT / "docs").rglob("*.md")):
        # A page of a record lists all files at its end.
        written = page.read_text(encoding="utf-8").partition(RECORD)[0]
        links = re.findall(r"\]\(([^)\s]+)\)", written)
        shown |= {(page.parent / link).resolve() for link in links if "figures/" in link}
    assert set(RECORDS.glob("*/figures/*")) == {path for path in shown if RECORDS in path.parents}
