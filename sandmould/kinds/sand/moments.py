"""Moments of a run: its snapshots by time, and those that pictures and exports show."""

from __future__ import annotations

import contextlib
import math
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

from sandmould.engines.snapshot import Snapshot, StoredSnapshot, stored_snapshots

MOMENTS = {"at its start": 0.0, "after 1/8": 0.125, "after 1/2": 0.5, "at its end": 1.0}
"""Shares of the vibration that are shown, by their heading."""


@dataclass(frozen=True)
class Moment:
    """A snapshot by its time; its grains are not read yet."""

    stored: StoredSnapshot
    time_s: float
    vibration_time_s: float
    """NaN before the first vibration."""

    def load(self) -> Snapshot:
        """Read its grains; a ValueError where they are damaged."""
        return self.stored.load()


def list_moments(run_folder: Path) -> tuple[Moment, ...]:
    """Readable snapshots of a run in order of time.

    One cut short by a killed run is passed over.
    """
    moments = []
    for stored in stored_snapshots(run_folder):
        with contextlib.suppress(Exception):  # numpy and zipfile raise a dozen on a broken file
            moments.append(Moment(stored, *stored.times_s()))
    return tuple(sorted(moments, key=lambda m: m.time_s))


def nearest(moments: Sequence[Moment], vibration_time_s: float) -> Moment:
    """The snapshot nearest a time of vibration; the last of several, where the sand has rested.

    The last of all where nothing vibrates.
    """
    shaken = [m for m in moments if not math.isnan(m.vibration_time_s)]
    if not shaken:
        return moments[-1]
    return min(shaken, key=lambda m: (abs(m.vibration_time_s - vibration_time_s), -m.time_s))
