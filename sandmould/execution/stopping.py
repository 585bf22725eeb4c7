"""Ctrl-C and kill: all that a command started ends with it, and one sentence says how to go on."""

from __future__ import annotations

import contextlib
import multiprocessing
import os
import shutil
import signal
import socket
import sys
import tempfile
from collections.abc import Callable, Iterator, Mapping
from functools import partial
from pathlib import Path
from types import FrameType, ModuleType
from typing import IO

from sandmould.runs.parent import end_with_parent, print_to

END_SIGNALS = (signal.SIGINT, signal.SIGTERM, signal.SIGHUP)
GRACE_S = 30.0
"""For Snakemake to cancel its jobs there."""


class Stopped(BaseException):
    """A signal that asks the command to end."""

    def __init__(self, number: int) -> None:
        self.status = 128 + number
        """Exit status, as a shell gives it."""
        self.said = ""
        """What goes on nevertheless."""
        super().__init__(number)


def until_stopped(work: Callable[[], int], name: str) -> int:
    """Do a command's work; at Ctrl-C or kill say that the same command goes on.

    Gives the exit status of the work, or that of a shell after the signal.
    """
    try:
        with _stopping():
            return work()
    except Stopped as stopped:
        print(f"\n{name} was stopped: the same command goes on with it.", file=sys.stderr)
        if stopped.said:
            print(stopped.said, file=sys.stderr)
        return stopped.status


@contextlib.contextmanager
def _stopping() -> Iterator[None]:
    """Raise ``Stopped`` at signals that ask to end; ignored ones, as under nohup, stay so."""
    before = {number: signal.getsignal(number) for number in END_SIGNALS}

    def stop(number: int, frame: FrameType | None) -> None:
        for each in END_SIGNALS:  # a second Ctrl-C must not break off the end
            signal.signal(each, signal.SIG_IGN)
        raise Stopped(number)

    for number, handler in before.items():
        if handler is not signal.SIG_IGN:
            signal.signal(number, stop)
    try:
        yield
    finally:
        for number, handler in before.items():
            signal.signal(number, handler)


def run_in_group(
    work: Callable[[], None],
    log: IO[str] | None = None,
    environment: Mapping[str, str] | None = None,
    look: Callable[[], float] | None = None,
    asked_first: bool = False,
) -> int:
    """Do work in a group of processes of its own, which ends as a whole.

    A signal of the terminal would reach every job by itself, and each would say so. Jobs on this
    machine are killed: a run goes on from its last checkpoint, bit for bit.

    ``work``: what the process does that is forked from this one; ends by ``SystemExit``. ``log``
    takes all that it and its jobs print; the terminal unless given. ``look``: called while it runs;
    gives the seconds until the next call. ``asked_first``: whether it is first asked to end, as
    Snakemake must be to cancel jobs elsewhere.

    Raises
    ------
    Stopped
        When a signal asked to end, after all processes ended.
    """
    # Its temporary files end with it, or with the next command where this one is killed.
    ours = f"sandmould-{socket.gethostname()}-"
    for left in Path(tempfile.gettempdir()).glob(f"{ours}*-*"):
        if sys.platform == "linux" and not Path("/proc", left.name.split("-")[-2]).exists():
            shutil.rmtree(left, ignore_errors=True)
    with tempfile.TemporaryDirectory(prefix=f"{ours}{os.getpid()}-") as temporary:
        begin = partial(_begin, work, log, environment or {}, temporary)
        process = multiprocessing.get_context("fork").Process(target=begin)
        before = signal.pthread_sigmask(signal.SIG_BLOCK, END_SIGNALS)
        process.start()
        assert process.pid is not None
        with contextlib.suppress(OSError):  # it does so itself, maybe later than a signal
            os.setpgid(process.pid, process.pid)
        signal.pthread_sigmask(signal.SIG_SETMASK, before)
        try:
            while process.exitcode is None:
                process.join(look() if look is not None else None)
            return process.exitcode
        except Stopped:
            if asked_first:
                _signal(process.pid, signal.SIGINT)
                process.join(GRACE_S)
            _signal(process.pid, signal.SIGKILL)
            process.join()
            raise


def _begin(
    work: Callable[[], None],
    log: IO[str] | None,
    environment: Mapping[str, str],
    temporary: str,
) -> None:
    """Let a forked process be one of its own, as if a command had started it."""
    os.setpgid(0, 0)
    for number in END_SIGNALS:
        if signal.getsignal(number) is not signal.SIG_IGN:
            python = number is signal.SIGINT
            signal.signal(number, signal.default_int_handler if python else signal.SIG_DFL)
    end_with_parent(signal.SIGKILL)
    signal.pthread_sigmask(signal.SIG_UNBLOCK, END_SIGNALS)
    nothing = os.open(os.devnull, os.O_RDONLY)
    os.dup2(nothing, 0)
    os.close(nothing)
    print_to(log.fileno() if log is not None else None)
    os.environ.update(environment)
    tempfile.tempdir = temporary
    # Processes that this one starts do not begin as the command did.
    sys.modules["__main__"] = ModuleType("__main__")
    work()


def _signal(group: int, number: signal.Signals) -> None:
    with contextlib.suppress(ProcessLookupError):
        os.killpg(group, number)
