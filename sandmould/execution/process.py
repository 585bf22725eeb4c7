"""Start a run as a process of its own and watch it; an outcome is written whatever happens."""

from __future__ import annotations

import collections
import contextlib
import fcntl
import os
import signal
import subprocess
import sys
from collections.abc import Callable, Iterator
from functools import partial
from pathlib import Path
from types import FrameType
from typing import IO, Protocol, TextIO

from sandmould.runs.claim import Claim, owner_of
from sandmould.runs.parent import end_with_parent
from sandmould.runs.words import say

RESTARTABLE_EXIT = 75
"""Exit status of a run that the same command continues (EX_TEMPFAIL of sysexits.h)."""
_END_SIGNALS = (signal.SIGKILL, signal.SIGTERM, signal.SIGINT, signal.SIGHUP)


class StartedRun(Protocol):
    """What is needed of a started process; ``subprocess.Popen`` has it."""

    @property
    def stdout(self) -> IO[str] | None:
        """What it prints, line by line."""

    def terminate(self) -> None:
        """Ask it to end."""

    def wait(self) -> int:
        """Exit status, or the number of the signal that ended it, negative."""


def launch(folder: Path, log: Path, ranks: int = 1, mpi: str = "mpiexec") -> None:
    """Compute a run in a process of its own, under MPI where it has several ranks.

    Parameters
    ----------
    folder : Path
        Holds ``scenario.yaml`` and the deck.
    log : Path
        Takes all that the process prints, which also goes to the terminal.
    ranks : int
        MPI ranks; 1 for an engine whose ranks are threads of one process.
    mpi : str
        Command that starts ranks, such as ``srun --mpi=pmi2``.

    Raises
    ------
    SystemExit
        When the run stopped early and the same command continues it.

    Notes
    -----
    A run whose outcome is already there is left as it is: Snakemake removes the outcome of a run
    that must be computed again.
    """
    command = [sys.executable, "-m", "sandmould.execution.simulate", str(folder)]

    def start(lock: TextIO) -> subprocess.Popen[str]:
        return subprocess.Popen(
            _under_mpi(command, ranks, mpi),
            stdout=subprocess.PIPE,
            stderr=subprocess.STDOUT,
            text=True,
            preexec_fn=end_with_parent,
            # It holds the run's lock, too: killed, this process may end before it.
            pass_fds=(lock.fileno(),),
        )

    def write_crash(detail: str) -> None:
        subprocess.run([*command, detail], check=True)

    watch(folder, log, start, write_crash)


def watch(
    folder: Path,
    log: Path,
    start: Callable[[TextIO], StartedRun],
    write_crash: Callable[[str], None],
    meanwhile: Callable[[], None] = lambda: None,
) -> None:
    """Compute a run in a process that is started here, and see to its outcome.

    Parameters
    ----------
    folder : Path
    log : Path
        Takes all that the process prints.
    start : callable
        Starts the process, which must hold the file that it is given: the run's lock.
    write_crash : callable
        Writes the outcome of a process that could not; takes what is known of its end.
    meanwhile : callable
        Done once the process has begun.

    Raises
    ------
    SystemExit
        When the run stopped early and the same command continues it.
    """
    end_with_parent()
    with log.open("a", encoding="utf-8") as log_file, _folder_lock(folder) as lock:
        if (folder / "outcome.json").exists():
            return  # finished meanwhile by a process that outlived its own snakemake
        process = start(lock)
        with passed_on(process):
            meanwhile()
            status, tail = listen(process, log_file, folder.name)
        if status == 0 or (folder / "outcome.json").exists():
            return  # killed after its outcome was there: nothing is left to do
        if status == RESTARTABLE_EXIT:
            raise SystemExit(f"{folder} stopped early: the same command continues it.")
        if -status in _END_SIGNALS:
            raise SystemExit(f"{folder} was killed: the same command continues it.")
        write_crash(f"the process ended with status {status}: {tail}")


def _under_mpi(command: list[str], ranks: int, mpi: str) -> list[str]:
    """Put the command that starts ranks in front, that of our own environment if it has it."""
    if ranks == 1:
        return command
    launcher, *options = mpi.split()
    own = Path(sys.executable).parent / launcher
    return [str(own) if own.exists() else launcher, *options, "-n", str(ranks), *command]


@contextlib.contextmanager
def _folder_lock(folder: Path) -> Iterator[TextIO]:
    """Wait for any other process that computes in a run's folder, of this machine or another.

    One can outlive a killed snakemake; the next snakemake then finds what it finished.
    """
    waiting = f"{folder}: waiting for the process that computes it"
    with _locked(folder / "lock", waiting) as (file, alone):
        claim = Claim(folder, alone, partial(_lost, folder))
        try:
            if not (folder / "outcome.json").exists():
                (folder / "work").mkdir(exist_ok=True)
            yield file
        finally:
            claim.let_go()
        if (folder / "outcome.json").exists():
            (folder / "lock").unlink(missing_ok=True)  # nothing is left to be guarded


@contextlib.contextmanager
def _locked(path: Path, waiting: str) -> Iterator[tuple[TextIO, bool]]:
    """Open a file and hold its lock, that of a file which still has its name.

    Beside the file stands False where the file system has no locks, even for one machine.
    """
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
    """End what computes in a folder that another process has taken over."""
    say(f"{folder}: another process has taken over, since this one stood still")
    for children in Path("/proc/self/task").glob("*/children"):
        for pid in children.read_text(encoding="ascii").split():
            os.kill(int(pid), signal.SIGKILL)


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


def is_locked(folder: Path) -> bool:
    """Whether a process computes in a run's folder, on this machine or on another."""
    try:
        with (folder / "lock").open() as file:
            fcntl.flock(file, fcntl.LOCK_SH | fcntl.LOCK_NB)
    except FileNotFoundError:
        return False
    except BlockingIOError:
        return True
    except OSError:
        return owner_of(folder, here=True) is not None
    return owner_of(folder) is not None


@contextlib.contextmanager
def passed_on(process: StartedRun) -> Iterator[None]:
    """Let the process end softly when this one is asked to, which may know more to do then."""
    before = signal.getsignal(signal.SIGTERM)

    def stop(number: int, frame: FrameType | None) -> None:
        process.terminate()
        if callable(before):
            before(number, frame)

    signal.signal(signal.SIGTERM, stop)
    yield
    signal.signal(signal.SIGTERM, before)


def listen(process: StartedRun, log: TextIO, run: str) -> tuple[int, str]:
    """Pass on what a process prints until it ends; gives its exit status and its last words.

    Lines of a log begin with the name of the run, since several may share it.
    """
    words: collections.deque[str] = collections.deque(maxlen=3)
    assert process.stdout is not None
    for line in process.stdout:
        log.write(line if line.startswith(run) or not line.strip() else f"{run}: {line}")
        log.flush()
        sys.stderr.write(line)
        sys.stderr.flush()
        if line.strip():
            words.append(line.strip())
    return process.wait(), " / ".join(words)
