"""What a process that was started does first, and what it says while it prints to a log."""

from __future__ import annotations

import contextlib
import ctypes
import os
import signal
import sys
from pathlib import Path

_PR_SET_PDEATHSIG, _PR_SET_NAME = 1, 15
"""Of Linux's prctl(2)."""
_PLACE = "SANDMOULD_WORDS"


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


def say(text: str) -> None:
    """Say something: to the command that started this process and asked for it, else to stderr."""
    place = os.environ.get(_PLACE)
    if place:
        with contextlib.suppress(OSError), open(place, "a", encoding="utf-8") as words:
            words.write(f"{text}\n")
            return
    print(text, file=sys.stderr, flush=True)


class Words:
    """What the processes that a command started have said."""

    def __init__(self, path: Path) -> None:
        """Begin with none; those of an earlier start are removed."""
        self._path = path
        self._path.write_bytes(b"")
        self._read = 0

    def environment(self) -> dict[str, str]:
        """Environment of a process that is to speak here."""
        return {**os.environ, _PLACE: str(self._path.absolute())}

    def new(self) -> str:
        """What has been said since the last call, whole lines only."""
        try:
            with self._path.open("rb") as words:
                words.seek(self._read)
                said = words.read()
        except OSError:
            return ""
        whole = said[: said.rfind(b"\n") + 1]
        self._read += len(whole)
        return whole.decode(errors="replace")
