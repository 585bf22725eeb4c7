"""A line on the terminal now and then: where the run is and when it will end."""

from __future__ import annotations

import json
import os
import sys
import time
from pathlib import Path

LINE_EVERY_S = 5.0


def duration_text(seconds: float) -> str:
    """Write a duration as a person would say it."""
    for unit, length in (("days", 86400.0), ("h", 3600.0), ("min", 60.0)):
        if seconds >= 2 * length:
            return f"{seconds / length:.1f} {unit}"
    return f"{seconds:.0f} s"


class Progress:
    """Progress of one run, to the terminal and to ``progress.json``."""

    def __init__(self, name: str, work: Path, expected_grain_steps: float) -> None:
        self._name = name
        self._path = work / "progress.json"
        self._expected = max(expected_grain_steps, 1.0)
        self._shown = -LINE_EVERY_S

    def show(
        self, stage: str, time_s: float, grain_steps: float, rate: float, last: bool = False
    ) -> None:
        """Show simulated time, percent, grain-steps per second and time left."""
        now = time.monotonic()
        if not last and now - self._shown < LINE_EVERY_S:
            return
        self._shown = now
        # Settling times are guesses: nothing is at 100 % before its end.
        percent = 100.0 if last else min(99.0, 100 * grain_steps / self._expected)
        left = max(0.0, self._expected - grain_steps) / rate if rate > 0 else float("inf")
        state = {
            "stage": stage,
            "time_s": time_s,
            "percent": percent,
            "grain_steps_per_s": rate,
            "left_s": 0.0 if last else left,
        }
        partial = self._path.with_name("progress.json.partial")
        partial.write_text(json.dumps(state), encoding="utf-8")
        os.replace(partial, self._path)
        bar = "#" * round(percent / 5)
        ending = "done" if last else f"about {duration_text(left)} left"
        print(
            f"{self._name}  [{bar:<20}] {percent:3.0f} %  {stage:<10} {time_s:8.3f} s simulated  "
            f"{rate / 1e6:5.2f} M grain-steps/s  {ending}",
            file=sys.stderr,
            flush=True,
        )
