"""The methods that are compared, all behind one line: asks, guesses, an end.

A method is called with a problem and gives a generator of messages. It is sent the value of every
``{"ask": point}``, None where a run gave none. ``{"guess": {name: point}}`` and ``{"ended": why}``
are told only; closing the generator ends the problem. The peers' programs send the same messages
as lines of JSON; see ``benchmarks/peers/jsonl_pipe.py``.
"""

from __future__ import annotations

import json
import math
import os
import subprocess
import tempfile
from collections.abc import Generator, Sequence
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any, Protocol

import numpy as np

from benchmarks.calibration.refine import best_guess, design, next_point
from sandmould.statistics.config import Target
from sandmould.statistics.emulator import TooFewRunsError, fit_emulator

Messages = Generator[dict[str, Any], float | None, None]
START = 16
"""First points, the same for every method; each takes as many as it can."""
CANDIDATES = 1024


class PeerError(RuntimeError):
    """A peer's program could not be started, or broke."""


@dataclass(frozen=True)
class CalibrationProblem:
    """One target and one start."""

    low: tuple[float, float]
    high: tuple[float, float]
    target: float
    sd: float
    """Of the measured value."""
    tolerance: float
    start: tuple[tuple[float, float], ...]
    seed: int
    go_on: bool = True
    """Whether to go on past the method's own end, up to the cap of the benchmark."""


class CalibrationMethod(Protocol):
    """A way to find two parameters."""

    name: str
    versions: dict[str, str]

    def solve(self, problem: CalibrationProblem) -> Messages:
        """Ask for runs and state guesses."""
        ...


def problem_of(
    low: Sequence[float], high: Sequence[float], target: float, sd: float, tolerance: float,
    seed: int, go_on: bool = True,
) -> CalibrationProblem:  # fmt: skip
    """State a problem whose start is the one of its seed."""
    (low_1, low_2), (high_1, high_2) = low, high
    start = tuple(map(tuple, design(low, high, START, seed).tolist()))
    return CalibrationProblem(
        (float(low_1), float(low_2)), (float(high_1), float(high_2)), target, sd, tolerance, start,
        seed, go_on,
    )  # fmt: skip


class Ours:
    """``benchmarks.calibration.refine``, one run after the other."""

    name = "sandmould"

    def __init__(self) -> None:
        self.versions: dict[str, str] = {}

    def solve(self, problem: CalibrationProblem) -> Messages:
        """Fit after every run once the emulator has the fewest points it takes."""
        target = Target(value=problem.target, sd=problem.sd)
        candidates = design(problem.low, problem.high, CANDIDATES, problem.seed)
        points, values = np.empty((0, 2)), np.empty(0)
        while len(points) < len(candidates):
            try:
                emulator = fit_emulator("angle", points, values)
            except TooFewRunsError:
                # The start, and beyond it where runs gave no value.
                point = candidates[len(points)]
            else:
                guess = best_guess(emulator, target, candidates)
                yield {"guess": {"least expected miss": guess.tolist()}}
                point = next_point(emulator, target, problem.tolerance, candidates, points)
            value = yield {"ask": point.tolist()}
            points = np.vstack([points, point])
            values = np.append(values, np.nan if value is None else value)
        yield {"ended": "no candidates are left"}


class Nearest:
    """The control, no method at all: a Sobol sequence, and the run nearest the target."""

    name = "no method"

    def __init__(self) -> None:
        self.versions: dict[str, str] = {}

    def solve(self, problem: CalibrationProblem) -> Messages:
        """Guess anew after every run."""
        least = math.inf
        for point in design(problem.low, problem.high, CANDIDATES, problem.seed).tolist():
            value = yield {"ask": point}
            if value is not None and abs(value - problem.target) < least:
                least, nearest = abs(value - problem.target), point
            if math.isfinite(least):
                yield {"guess": {"nearest run": nearest}}
        yield {"ended": "no points are left"}


class Peer:
    """A program that speaks over ``benchmarks/peers/jsonl_pipe.py``, for any number of problems."""

    def __init__(self, name: str, command: Sequence[str]) -> None:
        self.name = name
        # Matrices of ten rows gain nothing from threads, which would disturb what else runs.
        alone = {f"{library}_NUM_THREADS": "1" for library in ("OMP", "OPENBLAS")}
        # What the program prints is told only where it breaks; closed with it.
        self._chatter = tempfile.TemporaryFile("w+", errors="replace")  # noqa: SIM115
        try:
            self._process = subprocess.Popen(
                list(command),
                stdin=subprocess.PIPE,
                stdout=subprocess.PIPE,
                stderr=self._chatter,
                text=True,
                env=os.environ | alone,
            )
        except OSError as error:
            raise PeerError(f"{name} cannot be started: {error}; make peers installs it") from None
        self.versions = {str(k): str(v) for k, v in self._hear()["versions"].items()}

    def solve(self, problem: CalibrationProblem) -> Messages:
        """Pass messages on; a problem given up is stopped at the next run asked for."""
        self._say(asdict(problem))
        message = self._hear()
        try:
            while "ended" not in message:
                value = yield message
                if "ask" in message:
                    self._say({"value": value})
                message = self._hear()
        except GeneratorExit:
            while "ended" not in message:
                if "ask" in message:
                    self._say({"stop": True})
                message = self._hear()
            raise
        yield message

    def close(self) -> None:
        """Hang up."""
        for pipe in (self._process.stdin, self._process.stdout):
            assert pipe is not None
            pipe.close()
        self._process.wait()
        self._chatter.close()

    def _say(self, message: dict[str, Any]) -> None:
        assert self._process.stdin is not None
        try:
            self._process.stdin.write(json.dumps(message) + "\n")
            self._process.stdin.flush()
        except BrokenPipeError:
            raise PeerError(f"{self.name} ended in the middle of a problem") from None

    def _hear(self) -> dict[str, Any]:
        assert self._process.stdout is not None
        line = self._process.stdout.readline()
        if not line:
            code = self._process.wait()
            self._chatter.seek(0)
            last = self._chatter.read().strip().rpartition("\n")[2]
            raise PeerError(f"{self.name} ended with status {code} before its time: {last}")
        message: dict[str, Any] = json.loads(line)
        return message


def open_peers(python: Path) -> list[Peer]:
    """Start the peers' programs in their own environment.

    Raises
    ------
    PeerError
    """
    if not python.exists():
        raise PeerError(f"{python} is not there: make peers makes the peers' environment")
    folder = Path(__file__).parents[1] / "peers"
    programs = {"GrainLearning": "run_grainlearning.py", "coexist": "run_coexist.py"}
    return [Peer(name, [str(python), str(folder / file)]) for name, file in programs.items()]
