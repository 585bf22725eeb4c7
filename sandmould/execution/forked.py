"""A piece of work in a process that is forked from one with all libraries loaded."""

from __future__ import annotations

import contextlib
import os
import signal
import sys
import traceback
from collections.abc import Callable
from typing import NoReturn, TextIO

from sandmould.runs.parent import call_process, end_with_parent

Work = Callable[[], int | None]
"""Gives the exit status; None for 0."""
PROCESS_NAME = "sandmould-run"
"""What lists of processes call it, where Linux takes a name of fifteen letters."""
BROKEN = 1
"""Exit status of work that raised."""
END_SIGNALS = (signal.SIGINT, signal.SIGTERM, signal.SIGHUP)


def fork(work: Work, begin: Callable[[], None], group: bool = False) -> int:
    """Start a process with all that is loaded here; gives its number.

    What may not be forked once it has begun, such as MPI or threads, must begin in the work.

    Parameters
    ----------
    work : callable
        Gives the exit status; None for 0.
    begin : callable
        Lets the child go of what is its parent's alone: handlers of signals, files. Until then
        no request to end reaches it.
    group : bool
        Whether it begins a group of processes, which can be ended as a whole.
    """
    for stream in (sys.stdout, sys.stderr):
        stream.flush()  # what lies in a buffer would be written by both
    before = signal.pthread_sigmask(signal.SIG_BLOCK, END_SIGNALS)
    parent = os.getpid()
    pid = os.fork()
    if pid == 0:
        if group:
            os.setpgid(0, 0)
        _work_on(work, begin, before, parent)
    if group:  # it does so itself, maybe later than a signal is sent to the group
        with contextlib.suppress(OSError):
            os.setpgid(pid, pid)
    signal.pthread_sigmask(signal.SIG_SETMASK, before)
    return pid


def print_to(out: int, err: int) -> None:
    """Have this process print to two open files."""
    os.dup2(out, 1)
    os.dup2(err, 2)
    sys.stdout, sys.stderr = (os.fdopen(n, "w", 1, closefd=False) for n in (1, 2))


class ForkedProcess:
    """Acts as a ``subprocess.Popen`` whose output is read as lines."""

    def __init__(self, work: Work) -> None:
        """Begin.

        Parameters
        ----------
        work : callable
            Gives the exit status; None for 0.
        """
        read, write = os.pipe()

        def begin() -> None:
            signal.signal(signal.SIGTERM, signal.SIG_DFL)
            end_with_parent()
            call_process(PROCESS_NAME)
            print_to(write, write)
            os.close(read)
            os.close(write)

        self.pid = fork(work, begin)
        os.close(write)
        self.stdout: TextIO = os.fdopen(read, encoding="utf-8", errors="replace")
        self._status: int | None = None

    def terminate(self) -> None:
        """Ask it to end."""
        if self._status is None:
            os.kill(self.pid, signal.SIGTERM)

    def wait(self) -> int:
        """Exit status, or the number of the signal that ended it, negative."""
        if self._status is None:
            _, ended = os.waitpid(self.pid, 0)
            self._status = os.waitstatus_to_exitcode(ended)
            self.stdout.close()
        return self._status


def _work_on(
    work: Work, begin: Callable[[], None], mask: set[int | signal.Signals], parent: int
) -> NoReturn:
    """Do the work in the child; nothing of the parent's own end is done here."""
    status = BROKEN
    try:
        begin()
        signal.pthread_sigmask(signal.SIG_SETMASK, mask)
        if os.getppid() == parent:
            status = work() or 0
    except SystemExit as end:
        status = _status_of(end)
    except BaseException:
        traceback.print_exc()
    finally:
        for stream in (sys.stdout, sys.stderr):
            stream.flush()
        os._exit(status)


def _status_of(end: SystemExit) -> int:
    """Exit status as Python gives it; a text is printed."""
    if isinstance(end.code, int) or end.code is None:
        return end.code or 0
    print(end.code, file=sys.stderr)
    return BROKEN
