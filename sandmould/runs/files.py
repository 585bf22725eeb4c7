"""Files that are whole wherever they are: written under another name and moved into place."""

from __future__ import annotations

import contextlib
import os
import shutil
import zipfile
from collections.abc import Iterator, Mapping
from pathlib import Path


@contextlib.contextmanager
def replaced(path: Path) -> Iterator[Path]:
    """Give a temporary name beside a file's own; what is there at the end takes its place.

    After an error the file stays as it was; that of a full disk is told its name.
    """
    partial = path.with_name(f"{path.name}.partial")
    try:
        yield partial
    except OSError as error:
        if error.errno is not None:
            error.filename = error.filename or str(path)
        raise
    os.replace(partial, path)


def write_text(path: Path, text: str) -> None:
    """Write a text file as a whole, in UTF-8."""
    with replaced(path) as partial:
        partial.write_text(text, encoding="utf-8")


def write_zip(path: Path, files: Mapping[str, Path]) -> None:
    """Write a zip of files by their names in it; the same files give the same bytes."""
    with zipfile.ZipFile(path, "w") as archive:
        for name, source in sorted(files.items()):
            head = zipfile.ZipInfo(name)  # without a time
            head.compress_type, head.external_attr = zipfile.ZIP_DEFLATED, 0o100644 << 16
            head.file_size = source.stat().st_size  # more than 2 GB need another form of head
            with source.open("rb") as file, archive.open(head, "w") as out:
                shutil.copyfileobj(file, out)
