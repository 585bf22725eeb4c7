"""How a peer's program talks with the benchmark: one JSON object a line, standard library only.

The program says once ``{"versions": {...}}``. Then, problem after problem: the benchmark sends the
problem; the program answers with any number of ``{"ask": point}``, each answered with
``{"value": number or null}``, and ``{"guess": {name: point}}``, not answered; its last line of a
problem is ``{"ended": why}``. ``{"stop": true}`` instead of a value ends a problem early.
"""

from __future__ import annotations

import json
import os
import sys
from collections.abc import Callable, Iterable, Mapping
from importlib import metadata
from typing import Any


class StopRequestedError(Exception):
    """The benchmark wants no more of this problem."""


class JsonlPipe:
    """The program's end of the line."""

    def __init__(self) -> None:
        # Libraries may print; what they print must not come between the lines.
        self._out = os.fdopen(os.dup(sys.stdout.fileno()), "w", encoding="utf-8")
        os.dup2(sys.stderr.fileno(), sys.stdout.fileno())

    def say(self, message: Mapping[str, Any]) -> None:
        """Send one line."""
        self._out.write(json.dumps(message) + "\n")
        self._out.flush()

    def ask(self, point: Iterable[float]) -> float | None:
        """Have one point simulated; None where its run gave no value.

        Raises
        ------
        StopRequestedError
        """
        self.say({"ask": [float(x) for x in point]})
        answer = json.loads(sys.stdin.readline() or '{"stop": true}')
        if answer.get("stop"):
            raise StopRequestedError
        value = answer["value"]
        return None if value is None else float(value)

    def guess(self, points: Mapping[str, Iterable[float]], **more: Any) -> None:
        """State the current best guesses by name."""
        named = {name: [float(x) for x in point] for name, point in points.items()}
        self.say({"guess": named, **more})


def serve(solve: Callable[[JsonlPipe, dict[str, Any]], str], packages: Iterable[str]) -> None:
    """Solve one problem after the other until the benchmark hangs up.

    Parameters
    ----------
    solve : callable
        Takes the pipe and the problem, and returns why it ended.
    packages : iterable of str
        Whose versions are told.
    """
    pipe = JsonlPipe()
    pipe.say({"versions": {name: metadata.version(name) for name in packages}})
    for line in sys.stdin:
        try:
            why = solve(pipe, json.loads(line))
        except StopRequestedError:
            why = "asked to stop"
        except Exception as error:
            # A method that breaks has failed this problem, not the benchmark.
            why = f"{type(error).__name__}: {error}"
        pipe.say({"ended": why})
