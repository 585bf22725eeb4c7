"""Who computes in a folder: locks that other processes see, on this machine and on others."""

from __future__ import annotations

import atexit
import contextlib
import fcntl
import os
import signal
from collections.abc import Iterator
from functools import partial
from pathlib import Path
from typing import TextIO

from sandmould.runs.claim import Claim, owner_of
from sandmould.runs.manifest import OUTCOME_FILE
from sandmould.runs.parent import say


@contextlib.contextmanager
def computing(folder: Path) -> Iterator[TextIO]:
    """Wait for any other process that computes in a run's folder, of this machine or another.

    One can outlive a killed Snakemake; the next one then finds what it finished. Gives the file
    whose lock is held: processes that have it hold the lock, too.
    """
    waiting = f"{folder}: waiting for the process that computes it"
    with _locked(folder / "lock", waiting) as (file, alone):
        claim = Claim(folder, alone, partial(_lost, folder))
        try:
            if not (folder / OUTCOME_FILE).exists():
                (folder / "work").mkdir(exist_ok=True)
            yield file
        finally:
            claim.let_go()
        if (folder / OUTCOME_FILE).exists():
            (folder / "lock").unlink(missing_ok=True)  # nothing is left to be guarded


@contextlib.contextmanager
def _locked(path: Path, waiting: str) -> Iterator[tuple[TextIO, bool]]:
    """Open a file and hold its lock, that of a file which still has its name.

    Beside the file stands False where the file system has no locks, even for one machine.
    """
    if path.is_fifo():  # to open it would never end
        path.unlink()
    while True:
        with path.open("a") as file:
            alone = _flock(file, waiting)
            with contextlib.suppress(FileNotFoundError):
                if path.stat().st_ino == os.fstat(file.fileno()).st_ino:
                    yield file, alone
                    return
        # who held it has finished, and removed it


def _flock(file: TextIO, waiting: str) -> bool:
    """Hold a file's lock; False where the file system has none, even for one machine."""
    try:
        fcntl.flock(file, fcntl.LOCK_EX | fcntl.LOCK_NB)
    except BlockingIOError:
        say(f"{waiting} already")
        fcntl.flock(file, fcntl.LOCK_EX)
    except OSError:
        return False
    return True


def _lost(folder: Path) -> None:
    """End this process and what it started, since another has taken over its folder."""
    say(f"{folder}: another process has taken over, since this one stood still")
    for children in Path("/proc/self/task").glob("*/children"):
        for pid in children.read_text(encoding="ascii").split():
            os.kill(int(pid), signal.SIGKILL)
    os.kill(os.getpid(), signal.SIGKILL)


def take_turn(study_folder: Path) -> contextlib.ExitStack | None:
    """Wait for any other Snakemake that computes a study; ends with what it gives.

    Two would remove and compute again what the other has just finished. None where the folder
    takes no file: the plan says so then.
    """
    with contextlib.ExitStack() as turn:
        try:
            study_folder.mkdir(parents=True, exist_ok=True)
            waiting = f"{study_folder}: waiting for the command that computes it"
            _, alone = turn.enter_context(_locked(study_folder / "lock", waiting))
            claim = Claim(study_folder, alone)
        except OSError:
            return None
        turn.callback(claim.let_go)
        return turn.pop_all()


def hold_turn(study_folder: Path) -> None:
    """Take the turn of a study until this process ends."""
    if turn := take_turn(study_folder):
        _HELD.push(turn)


_HELD = contextlib.ExitStack()


@atexit.register
def let_go() -> None:
    """Let others have what this process holds; its end does the same, but that of a forked one."""
    _HELD.close()


def is_locked(folder: Path) -> bool:
    """Whether a process computes in a run's folder, on this machine or on another."""
    path = folder / "lock"
    if path.is_fifo():
        return owner_of(folder) is not None
    try:
        with path.open() as file:
            fcntl.flock(file, fcntl.LOCK_SH | fcntl.LOCK_NB)
    except FileNotFoundError:
        return False
    except BlockingIOError:
        return True
    except OSError:
        return owner_of(folder, here=True) is not None
    return owner_of(folder) is not None
