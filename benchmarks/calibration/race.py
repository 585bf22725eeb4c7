"""Runs that a method needs until its guess is as good as asked."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
from typing import Any

import numpy as np

from benchmarks.calibration.methods import CalibrationMethod, CalibrationProblem, Messages
from benchmarks.calibration.oracle import Simulate

CAP = 150
HELD_AFTER = 40
"""Runs up to which a good guess has to stay good: whole generations of every method.
One good guess may be luck, and who guesses after every run has more chances of it."""


@dataclass
class Race:
    """What became of one problem, by the name of the guess."""

    runs: int = 0
    first: dict[str, int] = field(default_factory=dict)
    """Runs that had been made when the guess was good for the first time."""
    since: dict[str, int] = field(default_factory=dict)
    """Runs since which every guess was good, up to ``held_after``; none where the last was not."""
    names: list[str] = field(default_factory=list)
    ended: str = ""
    held_after: int = HELD_AFTER
    last: dict[str, Any] = field(default_factory=dict)
    """Last message with guesses, with all that came with it."""

    def enter(
        self, message: dict[str, Any], miss_of: Callable[..., float], tolerance: float
    ) -> None:
        """Enter guesses."""
        self.last = message
        for name, point in message["guess"].items():
            if name not in self.names:
                self.names.append(name)
            good = miss_of(point) <= tolerance
            if good:
                self.first.setdefault(name, self.runs)
            if self.runs <= self.held_after:
                if good:
                    self.since.setdefault(name, self.runs)
                else:
                    self.since.pop(name, None)

    @property
    def over(self) -> bool:
        """Whether every guess was good once and it is known whether it stays so."""
        good = bool(self.names) and len(self.first) == len(self.names)
        return good and self.runs >= self.held_after


def run_race(
    method: CalibrationMethod, problem: CalibrationProblem, simulate: Simulate,
    miss_of: Callable[..., float], cap: int = CAP, held_after: int = HELD_AFTER,
) -> Race:  # fmt: skip
    """Let a method ask for runs until its guesses are good, it ends, or the cap is reached.

    A guess counts the runs that were made before it was stated: all of its generation.

    Parameters
    ----------
    method : CalibrationMethod
    problem : CalibrationProblem
    simulate : callable
    miss_of : callable
        True miss of a point, degrees.
    cap : int
    held_after : int
        Runs up to which a good guess has to stay good.
    """
    race = Race(held_after=held_after)
    messages: Messages = method.solve(problem)
    try:
        message = next(messages)
        while True:
            value: float | None = None
            if "ask" in message:
                if race.runs == cap or race.over:
                    break
                value = simulate(message["ask"])
                value = value if math.isfinite(value) else None
                race.runs += 1
            elif "guess" in message:
                race.enter(message, miss_of, problem.tolerance)
            else:
                race.ended = message["ended"]
            message = messages.send(value)
    except StopIteration:
        pass
    finally:
        messages.close()
    return race


def quartiles(firsts: Sequence[int | None]) -> list[float | None]:
    """Lower quartile, median and upper quartile of runs needed; None where that is a failure.

    Failures count as longer than anything, so they move the quartiles as they should.
    """
    ordered = np.array([math.inf if n is None else n for n in firsts], dtype=np.float64)
    quantiles = np.quantile(ordered, [0.25, 0.5, 0.75], method="inverted_cdf")
    return [float(x) if math.isfinite(x) else None for x in quantiles]


def summarised(method: str, target: float, races: Sequence[Race]) -> list[dict[str, Any]]:
    """Rows of one method and target, one a kind of guess."""
    rows = []
    names = dict.fromkeys(name for race in races for name in race.names)
    for name in names or ("none stated",):
        firsts = [race.first.get(name) for race in races]
        since = [race.since.get(name) for race in races]
        rows.append({
            "method": method,
            "guess": name,
            "target_deg": target,
            "runs_needed": firsts,
            "quartiles": quartiles(firsts),
            "failures": firsts.count(None),
            "good_since": since,
            "since_quartiles": quartiles(since),
            "not_good_after": since.count(None),
            "seeds": len(races),
            "ended": sorted({race.ended for race in races if race.ended}),
        })  # fmt: skip
    return rows
