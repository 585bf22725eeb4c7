"""A conversation with the LIGGGHTS executable: commands go in, what it prints comes out."""

from __future__ import annotations

import contextlib
import functools
import os
import pty
import re
import select
import shutil
import signal
import struct
import subprocess
import termios
from pathlib import Path

import numpy as np

from sandmould.geometry.geometry import Array
from sandmould.runs.parent import end_with_parent

_VERSION = re.compile(r"LIGGGHTS-PUBLIC (\d+(?:\.\d+)+)")
_LOOK_EVERY_S = 1.0
"""How often a silent process is looked at, in case it died without closing its terminal."""
_HEADER = struct.Struct("=qq7i6dii")
"""Step, rows, triclinic, six kinds of boundary, six bounds, columns, processors."""


def executable() -> str | None:
    """Path of LIGGGHTS: the environment variable LIGGGHTS, or ``liggghts`` on the PATH."""
    return shutil.which(os.environ.get("LIGGGHTS") or "liggghts")


def version_in(text: str) -> str | None:
    """Version in LIGGGHTS's own first line."""
    match = _VERSION.search(text)
    return match.group(1) if match else None


@functools.cache
def version_of(path: str) -> str | None:
    """Ask an executable for its version."""
    try:
        ran = subprocess.run(
            [path, "-log", "none", "-help"], capture_output=True, text=True, timeout=60,
            stdin=subprocess.DEVNULL, env=_environment(),
        )  # fmt: skip
    except (OSError, subprocess.TimeoutExpired):
        return None
    return version_in(ran.stdout)


def _environment() -> dict[str, str]:
    """Our environment; a single process needs no daemon of Open MPI's beside it."""
    return {**os.environ, "OMPI_MCA_ess_singleton_isolated": "1"}


def _live_and_die_with_parent() -> None:
    """Leave signals to the parent, which ends in an orderly way with a checkpoint; end with it."""
    signal.pthread_sigmask(signal.SIG_BLOCK, (signal.SIGTERM, signal.SIGINT, signal.SIGHUP))
    end_with_parent(signal.SIGKILL)


class LiggghtsDied(Exception):  # noqa: N818 - the session turns it into an outcome
    """LIGGGHTS ended; carries its error message or its last words."""


class Conversation:
    """A living LIGGGHTS process that reads commands from a pipe and prints to a terminal.

    To a pipe it would print in blocks, and lose the last one, with its error message, when it
    aborts.
    """

    def __init__(self, path: str, folder: Path, log: Path) -> None:
        """Start LIGGGHTS. ``folder``: working folder, so that a deck's relative names hold."""
        self._screen, theirs = pty.openpty()
        _keep_line_ends(theirs)
        self._process = subprocess.Popen(
            [path, "-log", str(log.absolute())],
            stdin=subprocess.PIPE,
            stdout=theirs,
            stderr=theirs,
            cwd=folder,
            env=_environment(),
            preexec_fn=_live_and_die_with_parent,
        )
        os.close(theirs)
        assert self._process.stdin is not None
        self._pipe = self._process.stdin.fileno()
        os.set_blocking(self._pipe, False)
        self._requests = 0
        self._heard = b""

    def say(self, commands: str) -> str:
        """Have commands executed and wait for their end; gives what LIGGGHTS printed meanwhile.

        Raises LiggghtsDied.
        """
        self._requests += 1
        marker = f"<sandmould {self._requests}>"
        waiting = f'{commands.rstrip()}\nprint "{marker}"\n'.encode()
        end = f"{marker}\n".encode()
        while end not in self._heard:
            wanted = [self._pipe] if waiting else []
            readable, writable, _ = select.select([self._screen], wanted, [], _LOOK_EVERY_S)
            if writable:
                waiting = self._write(waiting)
            if readable:
                self._read()
            elif self._process.poll() is not None:
                raise self._died()
        printed, self._heard = self._heard.split(end, 1)
        return printed.decode(errors="replace")

    def _write(self, waiting: bytes) -> bytes:
        try:
            return waiting[os.write(self._pipe, waiting) :]
        except BrokenPipeError:
            return b""  # it is dying; its last words are still to be read
        except BlockingIOError:
            return waiting

    def _read(self) -> None:
        try:
            heard = os.read(self._screen, 65536)
        except OSError:  # Linux: the other end of the terminal is closed
            heard = b""
        if not heard:
            raise self._died()
        self._heard += heard

    def _died(self) -> LiggghtsDied:
        self._process.kill()
        status = self._process.wait()
        lines = [x.strip() for x in self._heard.decode(errors="replace").splitlines() if x.strip()]
        errors = [x for x in lines if x.startswith("ERROR")]
        words = errors[0] if errors else " / ".join(lines[-2:])
        return LiggghtsDied(words or f"nothing, and ended with status {status}")

    def close(self) -> None:
        """End LIGGGHTS."""
        with contextlib.suppress(OSError):
            assert self._process.stdin is not None
            self._process.stdin.close()
        self._process.kill()
        self._process.wait()
        with contextlib.suppress(OSError):
            os.close(self._screen)


def _keep_line_ends(terminal: int) -> None:
    """Have a terminal pass on line ends as they are."""
    attributes = termios.tcgetattr(terminal)
    attributes[1] &= ~termios.OPOST
    termios.tcsetattr(terminal, termios.TCSANOW, attributes)


def read_grains(path: Path) -> Array:
    """Read a binary dump of one instant, written by one process.

    Gives (n, columns) float64; sorted by the first column, the ids.

    Raises
    ------
    ValueError
        When the file is cut short.
    """
    data = path.read_bytes()
    if len(data) < _HEADER.size + 4:
        raise ValueError(f"{path}: cut short")
    header = _HEADER.unpack_from(data)
    rows, columns = header[1], header[-2]
    values = np.frombuffer(data, dtype=np.float64, offset=_HEADER.size + 4)
    if columns < 1 or values.size != rows * columns:
        raise ValueError(f"{path}: {values.size} numbers instead of {rows} x {columns}")
    table = values.reshape(rows, columns)
    return table[np.argsort(table[:, 0])]
