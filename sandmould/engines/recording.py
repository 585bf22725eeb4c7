"""What a run writes while it goes: the time series, the wall loads and the snapshots."""

from __future__ import annotations

import os
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import TextIO

from sandmould.engines.guard import Health
from sandmould.engines.session import Array
from sandmould.engines.snapshot import Snapshot, SnapshotFile
from sandmould.engines.table_periods import TablePeriod
from sandmould.runs.checkpoint_folders import CheckpointMark
from sandmould.runs.products import TABLE_PERIODS

_SERIES = ("time_s", "vibration_time_s", "stage", "grains", "kinetic_energy_j", "rms_speed_m_s",
           "largest_overlap_fraction")  # fmt: skip


class Recorder:
    """Appends to tables in a work folder; a resumed run cuts them back to its checkpoint."""

    def __init__(self, work: Path, dimension: int, mark: CheckpointMark | None = None) -> None:
        """Open the tables, cut back to what a checkpoint vouches for.

        ``mark``: the checkpoint that the run continues from.
        """
        create_tables(work, dimension)
        self._snapshots = SnapshotFile(work, mark.snapshots if mark else 0)
        self._load_sums: dict[str, Array] = {}
        self._checks = 0
        headers = _headers(dimension)
        sizes = {"series.tsv": mark.series_bytes, "loads.tsv": mark.loads_bytes} if mark else {}
        self._series, self._loads = (
            _open(work / name, len("\t".join(columns)) + 1, sizes.get(name))
            for name, columns in headers.items()
        )
        self._periods = work / TABLE_PERIODS
        _cut(self._periods, mark.table_bytes if mark else 0)

    @property
    def snapshots(self) -> int:
        """Snapshots written so far."""
        return self._snapshots.count

    def add_loads(self, loads: Mapping[str, Array] | None) -> None:
        """Take in the mean loads of a check that has ended; None where none has."""
        if loads is not None:
            self._load_sums = {k: self._load_sums.get(k, 0.0) + f for k, f in loads.items()}
            self._checks += 1

    def record(self, snapshot: Snapshot, health: Health) -> None:
        """Write one row of the series and one row a surface of the loads.

        Loads are means over the checks since the last row.
        """
        when = (f"{snapshot.time_s:.9g}", f"{snapshot.vibration_time_s:.9g}", snapshot.stage)
        measured = (health.kinetic_energy_j, health.rms_speed_m_s, health.largest_overlap_fraction)
        row = (*when, str(len(snapshot.id)), *(f"{x:.6g}" for x in measured))
        self._series.write("\t".join(row) + "\n")
        for surface, force_n in self._load_sums.items():
            mean = (f"{x / self._checks:.9g}" for x in force_n)
            self._loads.write("\t".join((*when, surface, *mean)) + "\n")
        self._load_sums, self._checks = {}, 0

    def add_periods(self, periods: Sequence[TablePeriod]) -> None:
        """Write a row for each period of a table on mounts, on disk at once."""
        for cells in (period.cells() for period in periods):
            is_new = not self._periods.exists()
            with self._periods.open("a", encoding="utf-8") as file:
                if is_new:
                    file.write("\t".join(cells) + "\n")
                file.write("\t".join(cells.values()) + "\n")

    def save(self, snapshot: Snapshot) -> None:
        """Write the next snapshot."""
        self._snapshots.append(snapshot)

    def sizes(self) -> tuple[int, int, int]:
        """Flush the tables and give their sizes in bytes, 0 of one that is not there."""
        for file in (self._series, self._loads):
            file.flush()
        of_periods = self._periods.stat().st_size if self._periods.exists() else 0
        return self._series.tell(), self._loads.tell(), of_periods

    def close(self) -> None:
        """Close the files."""
        self._snapshots.close()
        self._series.close()
        self._loads.close()


def _headers(dimension: int) -> dict[str, tuple[str, ...]]:
    forces = tuple(f"force_{axis}_n" for axis in "xyz"[:dimension])
    return {
        "series.tsv": _SERIES,
        "loads.tsv": ("time_s", "vibration_time_s", "stage", "surface", *forces),
    }


def create_tables(work: Path, dimension: int) -> None:
    """Make the tables of a run where they are missing."""
    for name, columns in _headers(dimension).items():
        if not (work / name).exists():
            (work / name).write_text("\t".join(columns) + "\n", encoding="utf-8")


def _cut(path: Path, trusted_bytes: int) -> None:
    """Cut a table back to its trusted part; without any it goes."""
    if trusted_bytes:
        os.truncate(path, trusted_bytes)
    else:
        path.unlink(missing_ok=True)


def _open(path: Path, header_bytes: int, trusted_bytes: int | None) -> TextIO:
    """Open a table for appending after its trusted part."""
    size = trusted_bytes or header_bytes
    file = path.open("r+", encoding="utf-8")
    file.truncate(size)
    file.seek(size)
    return file
