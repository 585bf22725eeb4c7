"""Where the runs of a study are, seen from what they write, with few looks."""

from __future__ import annotations

import contextlib
import os
from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from sandmould.definition.run import FILLS, LAST_MEASURED
from sandmould.plain_file import UNREADABLE, read_json
from sandmould.runs.outcome import Outcome, RunOutcome


@dataclass(frozen=True)
class Running:
    """A run that is being computed."""

    run: str
    stage: str = ""
    """Empty before its first progress."""
    percent: float = 0.0
    simulated_s: float = 0.0
    work_per_s: float = 0.0
    begun_s: float = 0.0
    """Time of the file system at which it began, or went on."""


@dataclass(frozen=True)
class Ended:
    """A run that is computed and measured."""

    run: str
    said: str
    """How it failed, as a sentence; empty where it reached its end."""


@dataclass
class RunWatch:
    """Looks again and again at the runs that are still to come.

    A run counts as ended when its last product has been written since the watch began: one that is
    measured again has it before.
    """

    folders: Mapping[str, Path]
    """Of the runs, and of the fills that they share."""
    waiting: list[str]
    """Those that lack something, in the order of the plan."""
    since_s: float
    """Time of the file system when the watch began."""
    running: dict[str, Running] = field(default_factory=dict)

    def __post_init__(self) -> None:
        self._before = {run: _time_ns(self._last(run)) for run in self.waiting}

    def look(self) -> list[Ended]:
        """Look once; gives the runs that have ended since the last look."""
        ended = [run for run in self.waiting if self._has_ended(run)]
        gone = set(ended)
        self.waiting = [run for run in self.waiting if run not in gone]
        self.running = {r.run: r for run in self.waiting if (r := self._running(run)) is not None}
        return [Ended(run, failure(self.folders[run])) for run in ended]

    def _last(self, run: str) -> Path:
        """File that is written last; nothing is measured of a fill."""
        folder = self.folders[run]
        return folder / ("outcome.json" if folder.parent.name == FILLS else LAST_MEASURED)

    def _has_ended(self, run: str) -> bool:
        now = _time_ns(self._last(run))
        return now not in (0, self._before[run]) and (self.folders[run] / "outcome.json").exists()

    def _running(self, run: str) -> Running | None:
        """Where a run is; None while it has not begun since the watch did."""
        folder = self.folders[run]
        begun_s = _time_ns(folder / "lock") / 1e9
        if _time_ns(folder / "outcome.json") / 1e9 >= self.since_s:
            return Running(run, "measures", 100.0, begun_s=max(begun_s, self.since_s))
        path = folder / "work" / "progress.json"
        if _time_ns(path) / 1e9 >= self.since_s:
            with contextlib.suppress(*UNREADABLE):
                now: dict[str, Any] = read_json(path)
                return Running(
                    run, str(now["stage"]), float(now["percent"]), float(now["time_s"]),
                    float(now["work_per_s"]), max(begun_s, self.since_s),
                )  # fmt: skip
        return Running(run, begun_s=begun_s) if begun_s >= self.since_s else None


def failure(folder: Path) -> str:
    """How the run of a folder failed, as a sentence; empty where it reached its end."""
    try:
        outcome = RunOutcome.read(folder / "outcome.json")
    except UNREADABLE:
        return "Its outcome cannot be read."
    if outcome.outcome is Outcome.FINISHED:
        return ""
    return f"{outcome.outcome.label}. {outcome.detail}".strip()


def file_time_s(path: Path) -> float:
    """Time of the file system when a file was written: clocks of machines may differ."""
    return _time_ns(path) / 1e9


def _time_ns(path: Path) -> int:
    try:
        return os.stat(path).st_mtime_ns
    except OSError:
        return 0
