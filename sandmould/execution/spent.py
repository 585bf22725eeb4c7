"""Processor time of a study: what each of its processes has spent, by its own word."""

from __future__ import annotations

import contextlib
from pathlib import Path

SPENT_FILE = "spent_s.txt"
"""In ``results/<study>``: a line for each process that ended."""


def note_spent(study_folder: Path, spent_s: float) -> None:
    """Write down what a process has spent, with children that do not do so themselves."""
    with contextlib.suppress(OSError), (study_folder / SPENT_FILE).open("a") as file:
        file.write(f"{spent_s:.2f}\n")


def noted_s(study_folder: Path) -> float:
    """What all that ended have spent."""
    with contextlib.suppress(OSError, ValueError):
        lines = (study_folder / SPENT_FILE).read_text(encoding="ascii").splitlines()
        return sum(float(line) for line in lines)
    return 0.0
