"""One command of a study: let it end, kill it at some moment, or see what it leaves."""

from __future__ import annotations

import os
import signal
import subprocess
import sys
import time
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import pandas as pd

from sandmould import ROOT
from sandmould.runs.columns import OUTCOME
from sandmould.study.collect import read_summary

STUDIES = Path(__file__).with_name("studies")
LIMIT_S = 300.0
_OF_THE_MACHINE = ("wall_s", "cpu_s", "_per_s", "memory", "solver_fraction", "outside_fraction")


@dataclass(frozen=True)
class Attempt:
    """How one call of the command ended."""

    status: int
    text: str
    took_s: float

    @property
    def has_traceback(self) -> bool:
        """Whether it told its reader a traceback instead of a sentence."""
        return "Traceback (most recent call last)" in self.text


def command(study: str, *options: str) -> list[str]:
    """The command of a study of this theme, on one core."""
    return [sys.executable, "-m", "sandmould.cli", "run", str(STUDIES / f"{study}.yaml"),
            "--cores", "1", *options]  # fmt: skip


def environment() -> Mapping[str, str]:
    """That of this process, with this checkout first."""
    return {**os.environ, "PYTHONPATH": str(ROOT)}


def started(words: Sequence[str], folder: Path) -> subprocess.Popen[str]:
    """Start a command as the leader of its own group of processes."""
    return subprocess.Popen(
        words, cwd=folder, env=environment(), text=True, start_new_session=True,
        stdout=subprocess.PIPE, stderr=subprocess.STDOUT,
    )  # fmt: skip


def ended(process: subprocess.Popen[str], begun_s: float, limit_s: float = LIMIT_S) -> Attempt:
    """Wait for a command; one that takes longer is killed and told by the status -9."""
    try:
        text, _ = process.communicate(timeout=limit_s)
    except subprocess.TimeoutExpired:
        kill_group(process)
        text, _ = process.communicate()
    return Attempt(process.returncode, text, time.perf_counter() - begun_s)


def run_to_its_end(study: str, folder: Path, *options: str) -> Attempt:
    """Call the command and wait."""
    begun_s = time.perf_counter()
    return ended(started(command(study, *options), folder), begun_s)


def run_and_kill(study: str, folder: Path, after_s: float) -> Attempt:
    """Call the command and kill all its processes at once, as a loss of power does."""
    begun_s = time.perf_counter()
    return ended(started(command(study), folder), begun_s, after_s)


def kill_group(process: subprocess.Popen[str]) -> None:
    """Kill a command and all that it started, those that lead groups of their own too."""
    for number in [process.pid, *_descendants(process.pid)]:
        try:
            os.kill(number, signal.SIGKILL)
        except ProcessLookupError:
            continue


def _descendants(parent: int) -> list[int]:
    told = subprocess.run(["ps", "-e", "-o", "pid=,ppid="], capture_output=True, text=True).stdout
    children: dict[int, list[int]] = {}
    for line in told.splitlines():
        number, above = map(int, line.split())
        children.setdefault(above, []).append(number)
    found, waiting = [], [parent]
    while waiting:
        below = children.get(waiting.pop(), [])
        found += below
        waiting += below
    return found


def results_of(study: str, folder: Path) -> Path:
    """Folder of a study's results under a working folder."""
    return folder / "results" / study


def largest_difference(study: str, folder: Path, undisturbed: Path) -> float:
    """Largest relative difference of any number of the summary from the undisturbed study's.

    Columns that tell of the machine are left out. Infinite where runs or columns are not the same.
    """
    one, other = (
        read_summary(results_of(study, f)).set_index("run") for f in (folder, undisturbed)
    )
    if list(one.index) != list(other.index) or not (one[OUTCOME] == other[OUTCOME]).all():
        return np.inf
    if set(one.columns) != set(other.columns):
        return np.inf
    worst = 0.0
    for name in other.columns:
        if any(part in name for part in _OF_THE_MACHINE):
            continue
        if not pd.api.types.is_numeric_dtype(other[name]):
            continue
        a, b = one[name].to_numpy(np.float64), other[name].to_numpy(np.float64)
        if (np.isnan(a) != np.isnan(b)).any():
            return np.inf
        scale = np.maximum(np.abs(b), 1e-300)
        worst = max(worst, float(np.nan_to_num(np.abs(a - b) / scale).max(initial=0.0)))
    return worst
