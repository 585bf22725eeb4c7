"""The state of every grain at one instant, and all of a run in a file that a kill leaves readable.

``snapshots.npz`` is a zip archive without compression: ``numpy.load("snapshots.npz")`` gives array
``position_m`` of snapshot 5 as ``000005/position_m``. The archive's directory is written when the
file is closed; without it the arrays are found by their own heads.
"""

from __future__ import annotations

import contextlib
import io
import struct
import zipfile
import zlib
from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field, fields
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from sandmould.geometry.geometry import Scene
from sandmould.runs.files import replaced
from sandmould.scenario.scenario import Scenario

SNAPSHOTS = "snapshots.npz"
_HEAD = struct.Struct("<4s5H3I2H")
"""Signature, version, flags, method, time, date, CRC-32, two sizes, lengths of name and extra."""
_MAGIC = b"PK\x03\x04"
_LAST = "radius_m"
"""Array that every snapshot has and that is written after all others."""


@dataclass(frozen=True)
class Snapshot:
    """Grains at one instant, sorted by id; positions and velocities relative to the box."""

    time_s: float
    """Simulated time since the first grain was inserted."""
    vibration_time_s: float
    """Time since the first vibration stage began; NaN before it."""
    stage: str
    id: NDArray[np.int64]
    """(n,) int64, starting at 1."""
    layer: NDArray[np.int64]
    """(n,) int64: the layer of fill that brought the grain, starting at 1."""
    position_m: NDArray[np.float64]
    """(n, d) float64, m."""
    velocity_m_s: NDArray[np.float64]
    """(n, d) float64, m/s."""
    spin_rad_s: NDArray[np.float64]
    """(n, 3) float64, rad/s; in 2D only the last component differs from zero."""
    radius_m: NDArray[np.float64]
    """(n,) float64, m."""
    orientation: NDArray[np.float64] | None = None
    """(n, 1) float64, rad, in 2D or (n, 9) float64, rotation matrices row by row, in 3D; None where
    ``record.orientation`` does not ask for it."""
    pattern_m: NDArray[np.float64] | None = None
    """(nv, d) float64, m: vertices of the pattern's outer line, where it bends."""
    pattern_load_n: NDArray[np.float64] | None = None
    """(nv, d) float64, N: the sand's force on each, its mean over the last record, or that of the
    last step where the pattern is stepped with the grains."""

    def arrays(self) -> dict[str, Any]:
        """Values by name, as files hold them."""
        values = {f.name: getattr(self, f.name) for f in fields(self)}
        return {name: value for name, value in values.items() if value is not None}

    @classmethod
    def of_arrays(cls, arrays: Mapping[str, Any]) -> Snapshot:
        """The snapshot that such values are of; a KeyError or TypeError where some are missing."""
        values = {f.name: arrays[f.name] for f in fields(cls) if f.name in arrays}
        values["time_s"] = float(values["time_s"])
        values["vibration_time_s"] = float(values["vibration_time_s"])
        values["stage"] = str(values["stage"])
        return cls(**values)


def scene_at(scenario: Scenario, snapshot: Snapshot) -> Scene:
    """Geometry that sand feels at a snapshot: opened gates away, the pattern bent.

    Loads of one way bend a pattern that the sand feels as drawn.
    """
    scene, pattern = scenario.scene_in(snapshot.stage), scenario.pattern
    if pattern is None or snapshot.pattern_m is None or pattern.loop.scheme == "one_way":
        return scene
    return scene.bent(pattern.name, snapshot.pattern_m)


@dataclass(frozen=True)
class _Place:
    """Where an array lies in the file."""

    begin: int
    size: int
    crc: int

    def read(self, path: Path) -> Any:
        with path.open("rb") as file:
            file.seek(self.begin)
            data = file.read(self.size)
        if len(data) != self.size or zlib.crc32(data) != self.crc:
            raise ValueError("its bytes do not match their checksum")
        return np.lib.format.read_array(io.BytesIO(data), allow_pickle=False)


@dataclass(frozen=True)
class StoredSnapshot:
    """A snapshot in a file; nothing of it is read yet."""

    path: Path
    """The file that holds it."""
    name: str
    """Its number with leading zeros."""
    _places: Mapping[str, _Place] = field(repr=False, compare=False)
    """Of its arrays."""

    def load(self) -> Snapshot:
        """Read it.

        Raises
        ------
        ValueError
            When it is damaged.
        """
        try:
            return Snapshot.of_arrays({k: p.read(self.path) for k, p in self._places.items()})
        except Exception as error:
            raise ValueError(
                f"{self.path}: snapshot {self.name} cannot be read ({error})"
            ) from error

    def times_s(self) -> tuple[float, float]:
        """Simulated time and time of vibration; raises whatever a broken file leads to."""
        times = (self._places[name].read(self.path) for name in ("time_s", "vibration_time_s"))
        time_s, vibration_s = map(float, times)
        return time_s, vibration_s


def stored_snapshots(folder: Path) -> list[StoredSnapshot]:
    """Snapshots of a run's folder, or of its work folder, in order of their numbers."""
    path = folder / SNAPSHOTS
    places: dict[str, dict[str, _Place]] = {}
    if path.is_file():
        for name, place in _places(path):
            number, _, array = name.removesuffix(".npy").partition("/")
            places.setdefault(number, {})[array] = place
    return [StoredSnapshot(path, n, at) for n, at in sorted(places.items()) if _LAST in at]


def _places(path: Path) -> Iterator[tuple[str, _Place]]:
    """Arrays of a file, by its directory or one after the other."""
    try:
        with zipfile.ZipFile(path) as archive:
            members = archive.infolist()
    except zipfile.BadZipFile:
        yield from _places_of_torn(path)
        return
    for member in members:
        begin = member.header_offset + _HEAD.size + len(member.filename)
        yield member.filename, _Place(begin, member.file_size, member.CRC)


def _places_of_torn(path: Path) -> Iterator[tuple[str, _Place]]:
    """Arrays of a file without a directory, up to the first that is not whole."""
    size, at = path.stat().st_size, 0
    with path.open("rb") as file:
        while at + _HEAD.size <= size:
            file.seek(at)
            head = _HEAD.unpack(file.read(_HEAD.size))
            magic, method, (crc, stored, length, name) = head[0], head[3], head[6:10]
            begin = at + _HEAD.size + name
            at = begin + stored
            if magic != _MAGIC or method or not stored or stored != length or at > size:
                return
            yield file.read(name).decode(), _Place(begin, stored, crc)


class SnapshotFile:
    """Takes the snapshots of a run that goes on."""

    def __init__(self, work: Path, snapshots: int) -> None:
        """Open the file with the first so many snapshots; what came later is cut off."""
        path = work / SNAPSHOTS
        first = stored_snapshots(work)[:snapshots]
        if not _is_closed_with(path, first):
            with replaced(path) as partial, zipfile.ZipFile(partial, "w") as archive:
                for number, stored in enumerate(first):
                    _append(archive, f"{number:06d}", stored.load())
        self.count = len(first)
        self._file = path.open("r+b")
        self._archive = zipfile.ZipFile(self._file, "a")

    def append(self, snapshot: Snapshot) -> None:
        """Write the next snapshot; a kill after this does not lose it."""
        _append(self._archive, f"{self.count:06d}", snapshot)
        self._file.flush()
        self.count += 1

    def close(self) -> None:
        """Write the directory. A disk that takes no more keeps it from that, and loses nothing."""
        with contextlib.suppress(OSError, ValueError):
            self._archive.close()
        with contextlib.suppress(OSError):
            self._file.close()


def close_torn(work: Path) -> None:
    """Give the file of a run that crashed its directory, and cut off what is torn."""
    if stored := stored_snapshots(work):
        SnapshotFile(work, len(stored)).close()


def _is_closed_with(path: Path, stored: list[StoredSnapshot]) -> bool:
    """Whether a file has its directory and these snapshots, no more."""
    try:
        with zipfile.ZipFile(path) as archive:
            numbers = {name.partition("/")[0] for name in archive.namelist()}
    except (OSError, zipfile.BadZipFile):
        return False
    return numbers == {each.name for each in stored}


def _append(archive: zipfile.ZipFile, number: str, snapshot: Snapshot) -> None:
    """Write the arrays of a snapshot, without the time of day: the same run gives the same file."""
    arrays = snapshot.arrays()
    for name in sorted(arrays, key=lambda name: name == _LAST):
        data = io.BytesIO()
        np.lib.format.write_array(data, np.asanyarray(arrays[name]), allow_pickle=False)
        archive.writestr(zipfile.ZipInfo(f"{number}/{name}.npy"), data.getvalue())
