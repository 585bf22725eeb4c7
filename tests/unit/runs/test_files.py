"""Files that appear whole, and hashes of what is in them."""

from __future__ import annotations

import hashlib
import os
from pathlib import Path

import pytest

from sandmould.digest import digest, file_digest
from sandmould.runs.files import replaced, write_text, write_zip


def test_a_file_appears_when_it_is_whole(tmp_path: Path) -> None:
    path = tmp_path / "table.tsv"
    write_text(path, "old\n")
    with replaced(path) as partial:
        partial.write_text("new", encoding="utf-8")
        assert partial.parent == path.parent  # of the same disk: moving is one act
        assert path.read_text(encoding="utf-8") == "old\n"
    assert path.read_text(encoding="utf-8") == "new"
    assert list(tmp_path.iterdir()) == [path]


def test_a_full_disk_is_told_with_the_name_of_the_file(tmp_path: Path) -> None:
    path = tmp_path / "table.tsv"
    write_text(path, "old")
    path.with_name("table.tsv.partial").symlink_to("/dev/full")
    with pytest.raises(OSError, match=r"No space left on device: .*table\.tsv'"):
        write_text(path, "new")
    assert path.read_text(encoding="utf-8") == "old"


def test_an_error_leaves_the_file_as_it_was(tmp_path: Path) -> None:
    path = tmp_path / "table.tsv"
    write_text(path, "old")
    with pytest.raises(ZeroDivisionError), replaced(path) as partial:
        partial.write_text(f"half {1 / 0}", encoding="utf-8")
    assert path.read_text(encoding="utf-8") == "old"


def test_digests_are_those_of_the_bytes(tmp_path: Path) -> None:
    first, second = tmp_path / "a", tmp_path / "b"
    first.write_bytes(b"one")
    second.write_bytes(b"two")
    assert digest("on", b"e") == file_digest(first) == hashlib.sha256(b"one").hexdigest()


def test_the_same_files_give_the_same_zip(tmp_path: Path) -> None:
    paths = {name: tmp_path / name for name in ("a", "b")}
    for path in paths.values():
        path.write_text(path.name)
    write_zip(tmp_path / "one.zip", paths)
    os.utime(paths["a"], (0, 0))
    write_zip(tmp_path / "other.zip", dict(reversed(paths.items())))
    assert (tmp_path / "one.zip").read_bytes() == (tmp_path / "other.zip").read_bytes()
