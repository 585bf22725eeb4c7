"""The documentation can be read whole: its words are counted, and each page is short.

A word is what stands between blanks, as ``wc -w`` counts: bars and figures of tables count too.
Two kinds of pages are counted apart. ``REFERENCE`` is written from the keys, measures, columns and
commands of the code. ``TABLES`` are written from results and are little else than one table.
"""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path

import pytest
from mkdocs.config import load_config

from sandmould import ROOT

DOCS = ROOT / "docs"
MOST_WORDS = 80_000
MOST_WORDS_OF_A_PAGE = 1_500
LEAST_SHARE_OF_TABLES = 0.9
REFERENCE = ("commands.md", "files.md", "keys.md", "limits.md", "measures.md")
TABLES = (
    "developers/mutations.md",
    "reproduction_hirata_2017.md",
    "reproduction_hirata_2019.md",
    "reproduction_rojek_2004.md",
    "results/README.md",
    "verification_figures.md",
)


def words(text: str) -> int:
    return len(text.split())


def page_names() -> dict[str, Path]:
    return {page.relative_to(DOCS).as_posix(): page for page in sorted(DOCS.rglob("*.md"))}


def counted() -> dict[str, int]:
    """Words of each page that a person writes, or a template with its figures."""
    apart = {*REFERENCE, *TABLES}
    return {
        name: words(page.read_text(encoding="utf-8"))
        for name, page in page_names().items()
        if name not in apart
    }


def test_all_pages_together_can_be_read() -> None:
    assert sum(counted().values()) <= MOST_WORDS


def test_each_page_is_short() -> None:
    assert {n: count for n, count in counted().items() if count > MOST_WORDS_OF_A_PAGE} == {}


@pytest.mark.parametrize("name", TABLES)
def test_a_page_counted_apart_as_a_table_is_one(name: str) -> None:
    text = (DOCS / name).read_text(encoding="utf-8")
    rows = [line for line in text.splitlines() if line.startswith("|")]
    assert words("\n".join(rows)) >= LEAST_SHARE_OF_TABLES * words(text)


def pages_of(entries: list[object]) -> Iterator[str]:
    """Pages of a part of the navigation."""
    for entry in entries:
        value = next(iter(entry.values())) if isinstance(entry, dict) else entry
        if isinstance(value, list):
            yield from pages_of(value)
        else:
            yield str(value)


def test_pages_for_developers_stand_apart_and_each_page_has_its_place() -> None:
    nav = load_config(str(ROOT / "mkdocs.yml")).nav or []
    *of_users, of_developers = (list(pages_of([part])) for part in nav)
    assert all(page.startswith("developers/") for page in of_developers)
    assert not [page for part in of_users for page in part if page.startswith("developers/")]
    placed = [page for part in (*of_users, of_developers) for page in part]
    single = {name for name in page_names() if not name.startswith("results/")}
    assert sorted(placed) == sorted(single | {"results/README.md"})
