"""Readers in a watched process: it may not write elsewhere, hang, or take all memory."""

from __future__ import annotations

import multiprocessing
import os
import resource
import sys
import tempfile
import traceback
import warnings
from multiprocessing.connection import Connection
from pathlib import Path
from typing import Any

from sandmould.kernel_cache import cache_folder
from tests.fuzz.readers import PROBE, READERS

LIMIT_S = 60.0
"""A reader that takes longer hangs: a study of a thousand patterns takes half of it to expand."""
MEMORY_BYTES = 6 << 30
_WRITES = {"os.remove", "os.rename", "os.mkdir", "os.rmdir", "os.link", "os.symlink",
           "os.truncate", "os.chmod", "os.chown", "shutil.rmtree", "shutil.move"}  # fmt: skip
_STARTS = {"os.system", "os.exec", "os.posix_spawn", "os.spawn", "os.fork", "socket.connect",
           "subprocess.Popen"}  # fmt: skip


class _Forbidden(BaseException):
    """Something that no reader may do; no reader's ``except Exception`` hides it."""


class Watched:
    """A process that reads one file after another; a new one where it hangs or dies."""

    def __init__(self) -> None:
        self._process: multiprocessing.process.BaseProcess | None = None
        self._pipe: Connection

    def finding(self, reader: str, data: bytes, suffix: str) -> str:
        """Read a file; empty where the reader took it or refused it in order, else what it did."""
        if self._process is None or not self._process.is_alive():
            self._start()
        with tempfile.TemporaryDirectory() as name:
            path = Path(name) / f"file{suffix}"
            path.write_bytes(data)
            self._pipe.send((reader, str(path)))
            if not self._pipe.poll(LIMIT_S):
                self.close()
                return f"it hangs: no end after {LIMIT_S:g} s"
            try:
                return str(self._pipe.recv())
            except EOFError:
                assert self._process is not None
                self._process.join()
                return f"the process died, exit code {self._process.exitcode}"

    def _start(self) -> None:
        self._pipe, theirs = multiprocessing.Pipe()
        spawn = multiprocessing.get_context("spawn")
        self._process = spawn.Process(target=_serve, args=(theirs,), daemon=True)
        self._process.start()
        theirs.close()

    def close(self) -> None:
        """End the process."""
        if self._process is not None:
            self._process.kill()
            self._process.join()
            self._process = None


def _serve(pipe: Connection) -> None:
    resource.setrlimit(resource.RLIMIT_AS, (MEMORY_BYTES, MEMORY_BYTES))
    resource.setrlimit(resource.RLIMIT_CORE, (0, 0))
    sys.dont_write_bytecode = True
    warnings.simplefilter("ignore")
    # what readers say of a damaged file is no finding
    with open(os.devnull, "w", encoding="utf-8") as nowhere:
        sys.stdout = sys.stderr = nowhere
        # Compiled code is kept there, and some readers are the first to need it; tests reach it by
        # a link.
        allowed: list[str] = [os.devnull, str(cache_folder().parent), str(cache_folder())]
        sys.addaudithook(lambda event, details: _watch(event, details, allowed))
        while True:
            try:
                reader, name = pipe.recv()
            except EOFError:
                return
            allowed[3:] = [os.path.dirname(name)]
            pipe.send(_read(reader, Path(name)))


def _read(name: str, path: Path) -> str:
    reader = READERS.get(name, PROBE)
    try:
        reader.read(path)
    except reader.refusals as error:
        return "" if str(error).strip() else "it refuses without a word"
    except (Exception, SystemExit, _Forbidden):
        return traceback.format_exc(limit=-4)
    return ""


def _watch(event: str, details: tuple[Any, ...], allowed: list[str]) -> None:
    if len(allowed) < 4:
        return
    if event in _STARTS:
        raise _Forbidden(f"{event}: {details[:2]}")
    place = ""
    if event == "open" and isinstance(details[0], str | bytes | os.PathLike):
        writes = os.O_WRONLY | os.O_RDWR | os.O_CREAT | os.O_APPEND | os.O_TRUNC
        place = os.fsdecode(details[0]) if details[2] & writes else ""
    elif event in _WRITES and isinstance(details[0], str | bytes | os.PathLike):
        place = os.fsdecode(details[0])
        if event in ("os.remove", "os.rmdir") and details[1] >= 0:  # seen from an open folder
            place = os.path.join(os.readlink(f"/proc/self/fd/{details[1]}"), place)
    if place and not os.path.realpath(place).startswith(tuple(map(os.path.realpath, allowed))):
        raise _Forbidden(f"{event} of {place}")
