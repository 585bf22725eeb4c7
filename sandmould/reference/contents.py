"""What files a study and its runs leave, and what stands in them, as ``files.yaml`` has it."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import yaml

from sandmould.runs.formatting import unit_of

SWEPT = "<swept key>"
MEASURES = "<measure>"


@dataclass(frozen=True)
class Described:
    """A column of a table, a key of a file, or a field of a frame."""

    name: str
    unit: str
    """1 for a pure number, nothing for words."""
    meaning: str


@dataclass(frozen=True)
class File:
    """A file, or files of one kind."""

    name: str
    meaning: str
    columns: tuple[Described, ...] = ()
    columns_of: str = ""
    """Another file that has the same."""


_TREE: dict[str, Any] = yaml.safe_load(
    Path(__file__).with_name("files.yaml").read_text(encoding="utf-8")
)


def _columns(part: Any) -> Iterator[Described]:
    """Columns of a mapping, of the name of a group, or of a list of both."""
    if isinstance(part, str):
        yield from _columns(_TREE["groups"][part])
    elif isinstance(part, list):
        for each in part:
            yield from _columns(each)
    else:
        for name, about in part.items():
            unit, meaning = (unit_of(name) or "1", about) if isinstance(about, str) else about
            yield Described(name, "" if unit == "words" else unit, meaning)


def _files(where: str) -> tuple[File, ...]:
    found: dict[str, File] = {}
    for name, about in _TREE[where].items():
        if isinstance(about, str):
            found[name] = File(name, about)
        elif isinstance(same := about["columns"], str):
            found[name] = File(name, about["is"], found[same].columns, same)
        else:
            found[name] = File(name, about["is"], tuple(_columns(same)))
    return tuple(found.values())


OF_ALL = _files("all")
"""Files of ``results``."""
OF_STUDY = _files("study")
"""Files of ``results/<study>``."""
OF_RUN = _files("run")
"""Files of ``results/<study>/runs/<run>``."""
