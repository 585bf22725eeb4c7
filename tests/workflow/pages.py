"""Pages that a person follows, and their fenced blocks."""

from __future__ import annotations

import re
from dataclasses import dataclass

from sandmould import ROOT

PAGES = sorted(
    page.relative_to(ROOT).as_posix()
    for page in (
        ROOT / "README.md",
        *(ROOT / "docs").glob("*.md"),
        *(ROOT / "docs/tutorials").glob("*.md"),
        *(ROOT / "docs/how-to").glob("*.md"),
    )
)
BLOCK = re.compile(
    r'^(?:<!-- (\w+): (\S+) -->\n)?```(\w*)(?: title="([^"]+)")?\n(.*?)^```$',
    re.MULTILINE | re.DOTALL,
)


@dataclass(frozen=True)
class Block:
    """A fenced block of a page; ``note`` is a comment right above it, such as ``with: tube``."""

    note: str
    noted: str
    language: str
    title: str
    text: str


def blocks(page: str) -> list[Block]:
    found = BLOCK.findall((ROOT / page).read_text(encoding="utf-8"))
    return [Block(*groups) for groups in found]
