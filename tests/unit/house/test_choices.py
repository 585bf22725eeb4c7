"""Each choice that a page argues is in the list of all choices."""

from __future__ import annotations

import re

from sandmould import ROOT

LISTED = re.findall(
    r"\(explanation/(\w+)\.md#", (ROOT / "docs/choices.md").read_text(encoding="utf-8")
)


def test_every_heading_is_listed() -> None:
    argued = {
        page.stem: len(re.findall(r"^## ", page.read_text(encoding="utf-8"), re.MULTILINE))
        for page in (ROOT / "docs/explanation").glob("*.md")
    }
    assert sum(argued.values()) > 90
    assert {page: LISTED.count(page) for page in argued} == argued
