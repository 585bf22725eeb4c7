"""A line on the terminal now and then: where the run is and when it will end."""

from __future__ import annotations

import json
import math
import os
import sys
import time
from pathlib import Path

from sandmould.runs.files import write_text

LINE_EVERY_S = 5.0
STATE_EVERY_S = 1.0
"""How often ``progress.json`` is written, which the table on the terminal is drawn from."""


def duration_text(seconds: float) -> str:
    """Write a duration as a person would say it."""
    for unit, length in (("days", 86400.0), ("h", 3600.0), ("min", 60.0)):
        if seconds >= 2 * length:
            return f"{seconds / length:.1f} {unit}"
    return f"{seconds:.0f} s"


class Progress:
    """Progress of one run, to the terminal and to ``progress.json``."""

    def __init__(
        self, name: str, work: Path, expected: float | None, unit: str = "grain-steps"
    ) -> None:
        """Begin.

        ``work`` takes ``progress.json``; ``expected``: work of the whole run in its unit, None
        where nobody knows.
        """
        self._name = name
        self._path = work / "progress.json"
        self._expected = math.inf if expected is None else max(expected, 1.0)
        self._unit = unit
        self._last_line_s = self._last_state_s = -math.inf
        self.earlier_cpu_s = 0.0
        """Processor time of the processes that this run went on from."""

    def show(self, stage: str, time_s: float, done: float, rate: float, last: bool = False) -> None:
        """Show simulated time, percent, work per second and time left: a line now and then."""
        now = time.monotonic()
        if not last and now - self._last_state_s < STATE_EVERY_S:
            return
        self._last_state_s = now
        # Settling times are guesses: nothing is at 100 % before its end.
        percent = 100.0 if last else min(99.0, 100 * done / self._expected)
        left = max(0.0, self._expected - done) / rate if rate > 0 else float("inf")
        state = {
            "stage": stage,
            "time_s": time_s,
            "percent": percent,
            "work_per_s": rate,
            "left_s": 0.0 if last else left,
            "cpu_s": self.earlier_cpu_s + sum(os.times()[:4]),
        }
        write_text(self._path, json.dumps(state))
        if not last and now - self._last_line_s < LINE_EVERY_S:
            return
        self._last_line_s = now
        bar = "#" * round(percent / 5)
        ending = f"about {duration_text(left)} left" if math.isfinite(left) else "time left unknown"
        ending = "done" if last else ending
        print(
            f"{self._name}  [{bar:<20}] {percent:3.0f} %  {stage:<10} {time_s:8.3f} s simulated  "
            f"{rate / 1e6:5.2f} M {self._unit}/s  {ending}",
            file=sys.stderr,
            flush=True,
        )
