"""Ctrl-C and kill: all that a command started ends with it, and one sentence says how to go on."""

from __future__ import annotations

import atexit
import contextlib
import os
import select
import signal
import sys
from collections.abc import Callable, Iterator, Mapping
from functools import partial
from types import FrameType
from typing import IO

from sandmould.execution.forked import END_SIGNALS, Work, fork, print_to
from sandmould.runs.parent import end_with_parent

GRACE_S = 30.0
"""For Snakemake to cancel its jobs there."""


class Stopped(BaseException):
    """A signal that asks the command to end."""

    def __init__(self, number: int) -> None:
        self.status = 128 + number
        """Exit status, as a shell gives it."""
        super().__init__(number)


def until_stopped(work: Callable[[], int], name: str) -> int:
    """Do a command's work; at Ctrl-C or kill say that the same command goes on.

    Parameters
    ----------
    work : callable
        Gives the exit status.
    name : str
        What the command computes.

    Returns
    -------
    int
        The exit status of the work, or that of a shell after the signal.
    """
    try:
        with _stopping():
            return work()
    except Stopped as stopped:
        print(f"\n{name} was stopped: the same command goes on with it.", file=sys.stderr)
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
    work: Work,
    log: IO[str] | None = None,
    environment: Mapping[str, str] | None = None,
    look: Callable[[], float] | None = None,
    asked_first: bool = False,
) -> int:
    """Do work in a group of processes of its own, which ends as a whole.

    A signal of the terminal would reach every job by itself, and each would say so. Jobs on this
    machine are killed: a run goes on from its last checkpoint, bit for bit.

    Parameters
    ----------
    work : callable
        What the process does that is forked from this one; gives its exit status.
    log : file, optional
        Takes all that it and its jobs print; the terminal unless given.
    environment : mapping of str to str, optional
    look : callable, optional
        Called while it runs; gives the seconds until the next call.
    asked_first : bool
        Whether it is first asked to end, as Snakemake must be to cancel jobs elsewhere.

    Returns
    -------
    int
        Exit status.

    Raises
    ------
    Stopped
        When a signal asked to end, after all processes ended.
    """
    pid = fork(partial(_do, work, environment), partial(_begin, log), group=True)
    try:
        while not _has_ended(pid, look() if look is not None else None):
            pass
        return os.waitstatus_to_exitcode(os.waitpid(pid, 0)[1])
    except Stopped:
        if asked_first:
            _signal(pid, signal.SIGINT)
            _has_ended(pid, GRACE_S)
        _signal(pid, signal.SIGKILL)
        with contextlib.suppress(ChildProcessError):
            os.waitpid(pid, 0)
        raise


def _begin(log: IO[str] | None) -> None:
    """Let a forked process be one of its own, as if a command had started it."""
    for number in END_SIGNALS:
        if signal.getsignal(number) is not signal.SIG_IGN:
            python = number is signal.SIGINT
            signal.signal(number, signal.default_int_handler if python else signal.SIG_DFL)
    end_with_parent(signal.SIGKILL)
    nothing = os.open(os.devnull, os.O_RDONLY)
    os.dup2(nothing, 0)
    os.close(nothing)
    print_to(*((1, 2) if log is None else (log.fileno(), log.fileno())))
    atexit._clear()


def _do(work: Work, environment: Mapping[str, str] | None) -> int | None:
    os.environ.update(environment or {})
    try:
        return work()
    finally:
        atexit._run_exitfuncs()  # a forked process ends without, and the work may have left some


def _has_ended(pid: int, wait_s: float | None) -> bool:
    """Whether a process ends within some seconds; waits for it without a limit for None."""
    end = os.pidfd_open(pid)
    try:
        return bool(select.select([end], [], [], wait_s)[0])
    finally:
        os.close(end)


def _signal(group: int, number: signal.Signals) -> None:
    with contextlib.suppress(ProcessLookupError):
        os.killpg(group, number)
