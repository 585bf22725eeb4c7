"""Snapshots of runs as runs write them, and as a disk may damage them."""

from __future__ import annotations

import zipfile
from collections.abc import Iterable
from pathlib import Path

from sandmould.engines.snapshot import SNAPSHOTS, Snapshot, SnapshotFile

_HEAD_BYTES = 30
"""Before the name of a member of a zip archive."""


def write_snapshots(folder: Path, snapshots: Iterable[Snapshot], after: int = 0) -> None:
    """Write snapshots into a run's folder, after so many that are there."""
    folder.mkdir(parents=True, exist_ok=True)
    file = SnapshotFile(folder, after)
    for snapshot in snapshots:
        file.append(snapshot)
    file.close()


def damage(folder: Path, number: int) -> None:
    """Change the last byte of each array of a snapshot."""
    path = folder / SNAPSHOTS
    with zipfile.ZipFile(path) as archive:
        members = [m for m in archive.infolist() if m.filename.startswith(f"{number:06d}/")]
    with path.open("r+b") as file:
        for member in members:
            last = member.header_offset + _HEAD_BYTES + len(member.filename) + member.file_size - 1
            file.seek(last)
            byte = file.read(1)[0]
            file.seek(last)
            file.write(bytes([byte ^ 1]))
