"""Ctrl-C and kill: all that a command started ends with it, and one sentence says how to go on."""

from __future__ import annotations

import contextlib
import os
import signal
import subprocess
import sys
from collections.abc import Callable, Iterator, Mapping, Sequence
from functools import partial
from types import FrameType
from typing import IO

from sandmould.runs.parent import end_with_parent

_SIGNALS = (signal.SIGINT, signal.SIGTERM, signal.SIGHUP)
_ELSEWHERE = ("--executor", "-e", "--profile", "--workflow-profile")
"""Options of Snakemake that may send jobs to other machines."""
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
    before = {number: signal.getsignal(number) for number in _SIGNALS}

    def stop(number: int, frame: FrameType | None) -> None:
        for each in _SIGNALS:  # a second Ctrl-C must not break off the end
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


def run_snakemake(
    command: Sequence[str],
    log: IO[str] | None = None,
    environment: Mapping[str, str] | None = None,
    look: Callable[[], float] | None = None,
) -> int:
    """Run Snakemake in a group of processes of its own, which ends as a whole.

    A signal of the terminal would reach every job by itself, and each would say so. Jobs on this
    machine are killed: a run goes on from its last checkpoint, bit for bit. Where jobs may be
    elsewhere Snakemake is asked first, which cancels them.

    Parameters
    ----------
    command : sequence of str
    log : file, optional
        Takes all that it and its jobs print; the terminal unless given.
    environment : mapping of str to str, optional
    look : callable, optional
        Called while it runs; gives the seconds until the next call.

    Returns
    -------
    int
        Exit status.

    Raises
    ------
    Stopped
        When a signal asked to end, after all processes ended.
    """
    process = subprocess.Popen(
        command,
        stdin=subprocess.DEVNULL,
        stdout=log,
        stderr=log,
        env=environment,
        process_group=0,
        preexec_fn=partial(end_with_parent, signal.SIGKILL),
    )
    try:
        while look is not None:
            with contextlib.suppress(subprocess.TimeoutExpired):
                return process.wait(look())
        return process.wait()
    except Stopped:
        if any(option.split("=")[0] in _ELSEWHERE for option in command):
            _signal(process, signal.SIGINT)
            with contextlib.suppress(subprocess.TimeoutExpired):
                process.wait(GRACE_S)
        _signal(process, signal.SIGKILL)
        process.wait()
        raise


def _signal(process: subprocess.Popen[bytes], number: signal.Signals) -> None:
    with contextlib.suppress(ProcessLookupError):
        os.killpg(process.pid, number)
