"""Moments of a run: its snapshots by time, and those that pictures and exports show."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np

MOMENTS = {"at its start": 0.0, "after 1/8": 0.125, "after 1/2": 0.5, "at its end": 1.0}
"""Shares of the vibration that are shown, by their heading."""


@dataclass(frozen=True)
class Moment:
    """A snapshot's file and time; its grains are not read yet."""

    path: Path
    time_s: float
    vibration_time_s: float


def list_moments(run_folder: Path) -> tuple[Moment, ...]:
    """Readable snapshots of a run in order of time.

    A file cut short by a killed run is passed over.
    """
    moments = []
    for path in sorted((run_folder / "snapshots").glob("*.npz")):
        try:
            with np.load(path, allow_pickle=False) as data:
                times = float(data["time_s"]), float(data["vibration_time_s"])
        except Exception:  # numpy and zipfile raise a dozen kinds on a broken file
            continue
        moments.append(Moment(path, *times))
    return tuple(sorted(moments, key=lambda m: m.time_s))


def nearest(moments: Sequence[Moment], vibration_time_s: float) -> Moment:
    """The snapshot nearest a time of vibration; the last of several, where the sand has rested."""
    return min(moments, key=lambda m: (abs(m.vibration_time_s - vibration_time_s), -m.time_s))
