"""What a process says to the person at the terminal while its output goes to a log."""

from __future__ import annotations

import contextlib
import os
import sys
from pathlib import Path

_PLACE = "SANDMOULD_WORDS"


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
