"""Templates of users, rendered in a process of their own: in Jinja's sandbox, within limits."""

from __future__ import annotations

import contextlib
import functools
import json
import os
import select
import signal
import subprocess
import sys
import threading
import time
from collections.abc import Mapping
from pathlib import Path
from typing import Any

CPU_S = 10.0
"""Processor time of one rendering, s; a deck of a thousand lines takes milliseconds."""
WALL_S = 120.0
"""Wall time of one rendering, s, for a template that waits and so takes no processor time."""
MEMORY_BYTES = 512 * 2**20
"""Address space of the process; the interpreter with Jinja takes a tenth of it."""
MOST_CHARACTERS = 10_000_000
"""Of a template and of the deck that it makes."""
_PROGRAM = Path(__file__).with_name("template_process.py")


class TemplateError(ValueError):
    """A template that makes no deck; says why, and where that is known."""

    def __init__(self, fault: str, line: int | None = None) -> None:
        super().__init__(f"line {line}: {fault}" if line else fault)


@functools.lru_cache(maxsize=8)
def names_in(template: str) -> frozenset[str]:
    """Names that a template takes from outside.

    Raises
    ------
    TemplateError
    """
    return frozenset(_ask({"template": template})["names"])


def rendered(template: str, values: Mapping[str, Any]) -> str:
    """Render a template.

    ``values``: what JSON can hold.

    Raises
    ------
    TemplateError
        Also where the template hits a limit.
    """
    return str(_ask({"template": template, "values": dict(values)})["deck"])


def _ask(request: dict[str, Any]) -> dict[str, Any]:
    if len(request["template"]) > MOST_CHARACTERS:
        raise TemplateError(f"it has more than {MOST_CHARACTERS:,} characters")
    with _ONE_AT_A_TIME:
        process = _process_of(os.getpid())
        try:
            line = process.answer(json.dumps(request))
        except _EndedError as ended:
            _process_of.cache_clear()
            raise TemplateError(str(ended)) from None
    answer: dict[str, Any] = json.loads(line)
    if "fault" in answer:
        raise TemplateError(answer["fault"], answer["line"])
    return answer


class _EndedError(Exception):
    """The process ended over a template."""


class _Process:
    """The process that renders, kept for the next template: starting it takes longer than all."""

    def __init__(self) -> None:
        # An environment may hold what a template must not read; -I: no module from here.
        kept = {n: os.environ[n] for n in ("LD_LIBRARY_PATH",) if n in os.environ}
        limits = [str(MEMORY_BYTES), str(MOST_CHARACTERS), str(CPU_S)]
        self._process = subprocess.Popen(
            [sys.executable, "-I", str(_PROGRAM), *limits],
            stdin=subprocess.PIPE,
            stdout=subprocess.PIPE,
            stderr=subprocess.DEVNULL,
            cwd="/",
            env=kept,
        )
        assert self._process.stdin is not None
        assert self._process.stdout is not None
        self._to, self._from = self._process.stdin.fileno(), self._process.stdout.fileno()
        os.set_blocking(self._to, False)

    def answer(self, request: str) -> str:
        """Pass on a line and wait for the line that answers it."""
        waiting, heard = f"{request}\n".encode(), bytearray()
        until_s = time.monotonic() + WALL_S
        while not heard.endswith(b"\n"):
            left_s = until_s - time.monotonic()
            readable, writable, _ = select.select(
                [self._from], [self._to] if waiting else [], [], max(left_s, 0.0)
            )
            if not readable and not writable:
                raise self._ended(f"it takes longer than {WALL_S:g} s")
            if writable:
                with contextlib.suppress(BrokenPipeError):
                    waiting = waiting[os.write(self._to, waiting) :]
            if readable:
                part = os.read(self._from, 2**16)
                if not part:
                    raise self._ended()
                heard += part
        return heard.decode()

    def _ended(self, why: str = "") -> _EndedError:
        if why:
            self._process.kill()
        status = self._process.wait()
        if status == -signal.SIGPROF:
            why = f"it takes more than {CPU_S:g} s of processor time"
        return _EndedError(why or f"the process that renders it ended with status {status}")


@functools.cache
def _process_of(pid: int) -> _Process:
    """The process that renders for a process: one that was forked off has its own."""
    return _Process()


_ONE_AT_A_TIME = threading.Lock()
