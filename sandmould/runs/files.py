"""Files that are whole wherever they are: written under another name and moved into place."""

from __future__ import annotations

import contextlib
import os
from collections.abc import Iterator
from pathlib import Path


@contextlib.contextmanager
def replaced(path: Path) -> Iterator[Path]:
    """Give a temporary name beside a file's own; what is there at the end takes its place.

    After an error the file stays as it was.
    """
    partial = path.with_name(f"{path.name}.partial")
    yield partial
    os.replace(partial, path)


def write_text(path: Path, text: str) -> None:
    """Write a text file as a whole, in UTF-8."""
    with replaced(path) as partial:
        partial.write_text(text, encoding="utf-8")
