"""Each choice that a page argues is in the list of all choices, and so is each argued default."""

from __future__ import annotations

import re
from collections.abc import Iterator

import pytest
from pydantic import BaseModel

from sandmould import ROOT
from sandmould.kinds.registry import KINDS
from sandmould.reference.keys import keys_of

Section = type[BaseModel]
PAGE = (ROOT / "docs/choices.md").read_text(encoding="utf-8")
LISTED = re.findall(r"\(explanation/(\w+)\.md#", PAGE)
ENTRIES = re.findall(r"^\| (.*?) \|", PAGE, re.MULTILINE)


def test_every_heading_is_listed() -> None:
    argued = {
        page.stem: len(re.findall(r"^## ", page.read_text(encoding="utf-8"), re.MULTILINE))
        for page in (ROOT / "docs/explanation").glob("*.md")
    }
    assert sum(argued.values()) > 90
    assert {page: LISTED.count(page) for page in argued} == argued


def patterns(entry: str) -> Iterator[re.Pattern[str]]:
    """Paths of keys that the first cell of a row names; ``a.b`` is followed by ``c`` for ``a.c``.

    A section stands for its keys. Where no name of a cell has a dot, they may lie anywhere, such as
    `unit_m` of a drawing.
    """
    section = None
    for name in re.findall(r"`([a-z_.*]+)`", entry):
        if "." in name:
            section = name.rpartition(".")[0]
        elif section is not None:
            name = f"{section}.{name}"
        path = re.escape(name).replace(r"\.\*", r"(\.[^.]+)?")
        anywhere = "" if "." in entry.partition("](")[0] else r"(.*\.)?"
        yield re.compile(rf"{anywhere}{path}(\..*)?")


def argued_keys(section: Section, path: str = "") -> Iterator[tuple[Section, str, str]]:
    """Keys with a default that is argued: the section, the key, a path to it."""
    for key in keys_of(section):
        at = f"{path}.{key.name}".lstrip(".").removeprefix("scenario.")
        takes = not key.default.startswith("absent")
        if takes and key.about("source").startswith("argued default"):
            yield section, key.name, at
        for inner in key.below:
            yield from argued_keys(inner, at)


def unlisted(entries: list[str]) -> set[str]:
    """Argued defaults that no entry names, by any path to them."""
    paths: dict[tuple[Section, str], set[str]] = {}
    for kind in KINDS.values():
        for section, name, at in argued_keys(kind.study):
            paths.setdefault((section, name), set()).add(at)
    named = [pattern for entry in entries for pattern in patterns(entry)]
    return {
        " or ".join(sorted(each))
        for each in paths.values()
        if not any(pattern.fullmatch(at) for pattern in named for at in each)
    }


def test_every_argued_default_is_listed() -> None:
    assert unlisted(ENTRIES) == set()


@pytest.mark.parametrize("key", ["measure_at_rest", "sand.size_classes", "vibration.*.hold"])
def test_a_default_without_its_entry_is_found(key: str) -> None:
    assert any(
        key.replace(".*", "") in missing
        for missing in unlisted([entry for entry in ENTRIES if f"`{key}`" not in entry])
    )
