"""What a process that was started does first: whom it ends with, its name, where it prints."""

from __future__ import annotations

import ctypes
import os
import signal
import sys

_PR_SET_PDEATHSIG, _PR_SET_NAME = 1, 15
"""Of Linux's prctl(2)."""


def end_with_parent(number: signal.Signals = signal.SIGTERM) -> None:
    """Ask Linux to send this process a signal when the one that started it ends."""
    if sys.platform == "linux":
        ctypes.CDLL(None).prctl(_PR_SET_PDEATHSIG, number)


def call_process(name: str) -> None:
    """Have lists of processes show this one by a name of fifteen letters at most."""
    if sys.platform == "linux":
        ctypes.CDLL(None).prctl(_PR_SET_NAME, name.encode())


def print_to(file: int | None) -> None:
    """Have this process print to an open file, or where it did; what is printed is not kept."""
    for number in (1, 2):
        if file is not None:
            os.dup2(file, number)
    sys.stdout, sys.stderr = (os.fdopen(number, "w", 1, closefd=False) for number in (1, 2))
