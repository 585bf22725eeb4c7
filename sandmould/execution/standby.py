"""A process that has loaded what runs need before the first job asks for it.

It is forked from the command that has planned a study, loads while Snakemake builds its graph, and
forks for each job of a run. A job finds it by its environment, and ends when its work has ended. On
the nodes of a cluster there is none, and a job loads and does the same by itself. Nothing but the
standard library is loaded here until that is asked for: every job pays for it.
"""

from __future__ import annotations

import contextlib
import importlib
import json
import os
import select
import shutil
import signal
import socket
import sys
import tempfile
from collections.abc import Collection, Iterable, Iterator
from dataclasses import dataclass
from functools import partial
from pathlib import Path
from typing import Any

from sandmould.execution.forked import END_SIGNALS, fork, print_to
from sandmould.runs.parent import call_process, end_with_parent
from sandmould.runs.words import say

PLACE = "SANDMOULD_STANDBY"
"""Variable of the environment that names its socket."""


def do_job(work: str, *given: Any) -> None:
    """Do what a job is for, in a process that stands by where there is one.

    Parameters
    ----------
    work : str
        A function of ``sandmould.execution.run_jobs``.
    *given
        What it takes, as JSON can hold it.

    Raises
    ------
    SystemExit
        When it did not end well; it has said why.
    """
    status = _done_elsewhere(work, given)
    if status is None:
        _do(work, given)
    elif status:
        raise SystemExit(status)


def _do(work: str, given: Iterable[Any]) -> None:
    from sandmould.execution import run_jobs

    getattr(run_jobs, work)(*given)


def _done_elsewhere(work: str, given: Collection[Any]) -> int | None:
    """Have the process that stands by do some work; its exit status, None where it ended first."""
    place = os.environ.get(PLACE)
    if not place:
        return None
    with socket.socket(socket.AF_UNIX) as line:
        try:
            line.connect(place)
        except OSError:  # it has ended
            return None
        job = {"work": work, "given": given, "folder": os.getcwd(), "environment": {**os.environ}}
        status = ""
        with contextlib.suppress(OSError):
            socket.send_fds(line, [b"\n"], [1, 2])
            line.sendall(json.dumps(job).encode() + b"\n")
            status = line.makefile().readline()
    if status:
        return int(status)
    if os.path.exists(place):
        say("the process that loads what runs need was killed: this job goes on by itself")
        return None
    raise SystemExit("the command that started this job has ended")


@contextlib.contextmanager
def standing_by(scenarios: Collection[Any]) -> Iterator[None]:
    """Let a process stand by for the jobs that are started meanwhile; it ends with all it does.

    Parameters
    ----------
    scenarios : collection of scenarios
        One of each class of the runs.
    """
    folder = tempfile.mkdtemp(prefix="sandmould-")  # nobody else can enter it
    place = f"{folder}/socket"
    with socket.socket(socket.AF_UNIX) as listener:
        try:
            listener.bind(place)
            listener.listen(128)
        except OSError:  # the folder for such files has too long a name
            shutil.rmtree(folder)
            yield
            return
        pid = fork(partial(_stand_by, listener, scenarios), _begin, group=True)
    os.environ[PLACE] = place
    try:
        yield
    finally:
        del os.environ[PLACE]
        os.unlink(place)  # jobs see by this that they are to end, too
        with contextlib.suppress(ProcessLookupError):
            os.killpg(pid, signal.SIGKILL)
        os.waitpid(pid, 0)
        shutil.rmtree(folder, ignore_errors=True)


def _begin() -> None:
    """Be a process of its own, which no signal of the terminal reaches."""
    for number in END_SIGNALS:
        signal.signal(number, signal.SIG_DFL)
    end_with_parent(signal.SIGKILL)
    call_process("sandmould-ready")
    nothing = os.open(os.devnull, os.O_RDWR)
    os.dup2(nothing, 0)
    print_to(nothing, nothing)


@dataclass(frozen=True)
class _Job:
    """A job that waits at its line for the end of a process."""

    line: socket.socket
    pid: int
    end: int
    """File that tells of the end."""


class _Jobs:
    """Jobs that are being done, each by a process of its own."""

    def __init__(self, listener: socket.socket) -> None:
        self._listener = listener
        self._poll = select.poll()
        self._poll.register(listener, select.POLLIN)
        self._by_end: dict[int, _Job] = {}
        self._by_line: dict[int, _Job] = {}

    def wait(self) -> bool:
        """Wait for something to happen; whether a process has ended."""
        ended = False
        for file, _ in self._poll.poll():
            if file == self._listener.fileno():
                self._take(self._listener.accept()[0])
            elif file in self._by_end:
                self._finish(self._by_end.pop(file))
                ended = True
            elif file in self._by_line:
                # The job was killed: what it waits for is to end, too.
                os.kill(self._by_line[file].pid, signal.SIGTERM)
                self._forget_line(file)
        return ended

    def _take(self, line: socket.socket) -> None:
        others = [self._listener, *(job.line for job in self._by_end.values())]
        pid = fork(partial(_answer, line), partial(_begin_job, others))
        job = _Job(line, pid, os.pidfd_open(pid))
        self._by_end[job.end] = self._by_line[line.fileno()] = job
        self._poll.register(job.end, select.POLLIN)
        self._poll.register(line, 0)  # of it nothing but its end is of interest here

    def _finish(self, job: _Job) -> None:
        """Tell a job how its process ended, as a shell gives it."""
        ended = os.waitstatus_to_exitcode(os.waitpid(job.pid, 0)[1])
        with contextlib.suppress(OSError):
            job.line.sendall(f"{ended if ended >= 0 else 128 - ended}\n".encode())
        self._poll.unregister(job.end)
        os.close(job.end)
        if job.line.fileno() in self._by_line:
            self._forget_line(job.line.fileno())
        job.line.close()

    def _forget_line(self, file: int) -> None:
        del self._by_line[file]
        self._poll.unregister(file)


def _stand_by(listener: socket.socket, scenarios: Iterable[Any]) -> None:
    """Load what runs need, then fork for each job that asks."""
    from sandmould.execution.worker import load, load_kept

    importlib.import_module("sandmould.execution.run_jobs")
    for scenario in scenarios:
        load(scenario)
    jobs = _Jobs(listener)
    while True:
        if jobs.wait():
            for scenario in scenarios:
                load_kept(scenario)


def _begin_job(others: Iterable[socket.socket]) -> None:
    end_with_parent()
    call_process("sandmould-job")
    for line in others:
        line.close()


def _answer(line: socket.socket) -> None:
    """Do the work of one job, in its folder, with its environment and its output."""
    _, files, _, _ = socket.recv_fds(line, 1, 2)
    print_to(*files)
    job = json.loads(line.makefile().readline())
    os.environ.clear()
    os.environ.update(job["environment"])
    os.chdir(Path(job["folder"]))
    sys.argv = [job["work"]]
    _do(job["work"], job["given"])
