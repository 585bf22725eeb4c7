"""Processes of jobs: each piece of work has one of its own, and what runs need is loaded before.

The fork server of the standard library loads once and forks for every piece of work. One that
crashes or is killed takes no other with it. MPI, engines and threads begin in the work's process.
"""

from __future__ import annotations

import collections
import contextlib
import multiprocessing
import os
import signal
import sys
import threading
from collections.abc import Callable, Iterable
from multiprocessing import connection, forkserver
from multiprocessing.connection import Connection
from pathlib import Path
from typing import Any, NamedTuple

from sandmould.module_main import in_a_sentence
from sandmould.runs.parent import call_process, end_with_parent, print_to
from sandmould.runs.products import cpu_time_s, note_spent

LOADED_FIRST = "SANDMOULD_LOADED_FIRST"
"""Variable of the environment: scenarios of runs whose libraries the server loads."""
PROCESS_NAME = "sandmould-run"
"""What lists of processes call it, where Linux takes a name of fifteen letters."""
SERVER_LOST = 255
"""Exit status of work whose end is not known, since the server was killed; Python's own."""
_CONTEXT = multiprocessing.get_context("forkserver")
_ONE_AT_A_TIME = threading.Lock()
"""Starting a server changes the environment, starting a process asks all others whether they have
ended: two threads may do neither at a time."""


class End(NamedTuple):
    """How a piece of work ended."""

    status: int
    """Exit status, or the number of the signal that ended it, negative."""
    words: str
    """The last lines that it printed."""


def start_server(folders: Iterable[Path] = ()) -> None:
    """Start the server of this process, unless it is there; it loads while this process goes on.

    ``folders``: of runs, one of each class of those that are to be computed.
    """
    with _ONE_AT_A_TIME:
        _CONTEXT.set_forkserver_preload(["sandmould.execution.preload"])
        before = dict(os.environ)
        files = [str(folder.absolute() / "scenario.yaml") for folder in folders]
        os.environ[LOADED_FIRST] = os.pathsep.join(files)
        os.environ["PYTHONSAFEPATH"] = "1"  # a module in the user's working folder is not ours
        forkserver.ensure_running()
        for name in (LOADED_FIRST, "PYTHONSAFEPATH"):
            del os.environ[name]
        os.environ.update(before)


def do(work: Callable[..., int | None], *given: Any, log: Path, name: str = "") -> End:
    """Do a piece of work in a process of its own and wait for its end.

    ``work``: a function of a module; gives the exit status, None for 0. ``log`` takes all that it
    prints, which also goes to standard error. ``name``: of the run, which its lines in the log
    begin with, since several may share it.
    """
    start_server()
    reader, writer = _CONTEXT.Pipe(duplex=False)
    with _ONE_AT_A_TIME:
        study_folder = log.absolute().parent.parent
        begin = (writer, os.getcwd(), dict(os.environ), study_folder, work, given)
        process = _CONTEXT.Process(target=_begin, args=begin, daemon=True)
        process.start()
    writer.close()
    words: collections.deque[str] = collections.deque(maxlen=3)
    with (
        reader,
        open(reader.fileno(), encoding="utf-8", errors="replace", closefd=False) as lines,
        log.open("ab", buffering=0) as log_file,
    ):
        for line in lines:
            said = line if line.startswith(name) or not line.strip() else f"{name}: {line}"
            with contextlib.suppress(OSError):  # of a full disk the work's own words tell
                log_file.write(said.encode())
            sys.stderr.write(line)
            sys.stderr.flush()
            if line.strip():
                words.append(line.strip())
    connection.wait([process.sentinel])
    with _ONE_AT_A_TIME:
        process.join()
    assert process.exitcode is not None
    return End(process.exitcode, " / ".join(words))


def _begin(
    writer: Connection,
    folder: str,
    environment: dict[str, str],
    study_folder: Path,
    work: Callable[..., int | None],
    given: tuple[Any, ...],
) -> None:
    """Do the work in its folder, with its environment and its output."""
    end_with_parent()  # that is the server
    threading.Thread(target=_end_with_asker, daemon=True).start()
    call_process(PROCESS_NAME)
    for number in (signal.SIGTERM, signal.SIGINT):
        signal.signal(number, signal.SIG_DFL)
    print_to(writer.fileno())
    writer.close()
    os.environ.clear()
    os.environ.update(environment)
    os.chdir(folder)
    try:
        raise SystemExit(in_a_sentence(work, *given))
    finally:
        note_spent(study_folder, cpu_time_s())


def _end_with_asker() -> None:
    """Ask this process to end when the one that asked for its work has ended."""
    asker = multiprocessing.parent_process()
    assert asker is not None
    asker.join()
    nowhere = os.open(os.devnull, os.O_WRONLY)
    for number in (1, 2):  # nobody reads what it prints any more
        os.dup2(nowhere, number)
    os.kill(os.getpid(), signal.SIGTERM)
