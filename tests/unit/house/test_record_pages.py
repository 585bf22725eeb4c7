"""Pages of committed results: up to date, each with an answer, and what a person wrote stays."""

from __future__ import annotations

import shutil
from pathlib import Path

import pytest

from benchmarks.house.record_pages import RecordPage, index_text, pages
from sandmould.study.packs.recorded import RECORDS

PAGES = pages()


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
    for name in ("record.json", "runs.tsv", "summary.tsv", "summary_checks.tsv"):
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
