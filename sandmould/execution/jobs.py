"""What Snakemake's jobs do, each by processes of the pool: runs, and what is made of them."""

from __future__ import annotations

import contextlib
import os
import pkgutil
import signal
import subprocess
import sys
import threading
from collections.abc import Callable, Iterator, Sequence
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path
from types import FrameType
from typing import Any, TextIO

from sandmould.definition.run import LAST_MEASURED, Run
from sandmould.execution.locks import computing
from sandmould.execution.pool import SERVER_LOST, do, start_server
from sandmould.execution.simulate import (
    RESTARTABLE_EXIT,
    measure_run,
    render_run,
    simulate,
    write_crash,
)
from sandmould.kinds.registry import kind_of
from sandmould.runs.formatting import listed
from sandmould.runs.manifest import OUTCOME_FILE
from sandmould.runs.parent import end_with_parent
from sandmould.runs.provenance import commit, processor, versions
from sandmould.study.plan.batches import is_done
from sandmould.study.plan.lacking import Need, lack_of
from sandmould.study.plan.plan_files import read_run

ASKED_EXIT = 143
"""Exit status of a run that stopped early since its job is to end, as a shell gives SIGTERM."""
_ASKED = (ASKED_EXIT, -signal.SIGTERM)
_COMPILING = "sandmould.compiled"
_LONGEST = 200
"""Of the words of an engine."""
_KILLED = (SERVER_LOST, -signal.SIGKILL, -signal.SIGINT, -signal.SIGHUP, 128 + signal.SIGKILL)


class JobError(Exception):
    """A job did not reach its end; one sentence."""


class AskedToEndError(JobError):
    """A run stopped since its job was asked to end."""


def do_job(work: str, *given: Any, log: str) -> None:
    """Do one piece of work that computes no run.

    ``work``: module and function: what it imports is imported by its own process alone.

    Raises
    ------
    JobError
        Where it did not end well; it has said why, and its log keeps that.
    """
    Path(log).unlink(missing_ok=True)
    ended = do(_named, work, *given, log=Path(log))
    if ended.status:
        raise JobError(f"stopped: {log} says why")


def _named(work: str, *given: Any) -> None:
    pkgutil.resolve_name(work)(*given)


def compute_run(folder: Path, log: str, ranks: int, mpi: str) -> None:
    """Compute a run whose deck is there; an outcome is written whatever happens.

    ``ranks``: of MPI; 1 for an engine whose ranks are threads of one process. ``mpi``: command that
    starts them, such as ``srun --mpi=pmi2``.

    Raises
    ------
    JobError
        When it stopped early, and the same command continues it.
    """
    start_server([folder])
    _see_to_end(_simulate, folder, Path(log), ranks, mpi)


def compute_batch(
    folders: Sequence[Path], log: str, ranks: int, mpi: str, side_by_side: int = 1
) -> None:
    """Render, compute and measure runs, those left out that are there already.

    Raises
    ------
    JobError
        At the end, when a run stopped or broke: the same job continues it and redoes none.
    """
    start_server(folders[:1])
    asked_to_end = threading.Event()
    Path(log).touch()

    def compute(folder: Path) -> None:
        if asked_to_end.is_set():
            return
        try:
            _see_to_end(_do_all, folder, Path(log), ranks, mpi)
        except JobError as error:  # one bad run must not stop the others
            if isinstance(error, AskedToEndError):
                asked_to_end.set()
            print(f"{folder.name}: {error}", file=sys.stderr, flush=True)

    with ThreadPoolExecutor(side_by_side) as threads:
        list(threads.map(compute, folders))
    if stopped := [folder.name for folder in folders if not is_done(folder)]:
        raise JobError(f"{len(stopped)} of {len(folders)} stopped or broke: {listed(stopped)}")


def _see_to_end(work: Callable[..., int], folder: Path, log: Path, ranks: int, mpi: str) -> None:
    """Do some work on a run, and have its outcome written where it could not do so itself."""
    outcome = folder / OUTCOME_FILE
    ended = do(work, folder, ranks, mpi, log=log, name=folder.name)
    if ended.status and not outcome.exists():
        if ended.status in _ASKED:
            raise AskedToEndError("stopped early: the same command continues it")
        if ended.status == RESTARTABLE_EXIT:
            raise JobError("stopped early: the same command continues it")
        if ended.status in _KILLED:
            raise JobError("was killed: the same command continues it")
        if not (folder / "work").exists():
            raise JobError(ended.words)  # before it began
        words = ended.words or _last_words(folder / "work")
        why = f"the process ended with status {ended.status}{': ' if words else ''}{words}"
        if (writing := do(write_crash, folder, why, log=log, name=folder.name)).status:
            raise JobError(writing.words)
    if ended.status and work is _do_all:  # what is left is tried once more: its measures
        ended = do(work, folder, ranks, mpi, log=log, name=folder.name)
        if ended.status:
            raise JobError(ended.words)


def _last_words(work: Path) -> str:
    """Last line of an engine's newest log: a user's deck may end it with a word of its own."""
    logs = sorted(work.glob("*.log"), key=lambda path: path.stat().st_mtime)
    lines = logs[-1].read_text(encoding="utf-8", errors="replace").split("\n") if logs else []
    return next((line.strip()[:_LONGEST] for line in reversed(lines) if line.strip()), "")


def _do_all(folder: Path, ranks: int, mpi: str) -> int:
    """Do what is missing of one run; the exit status."""
    run = read_run(folder / "scenario.yaml")
    if lack_of(run, folder).need is Need.COMPUTE:
        for old in (OUTCOME_FILE, LAST_MEASURED):
            (folder / old).unlink(missing_ok=True)  # damaged, or of another scenario or deck
        render_run(folder, run)
        if status := _simulate(folder, ranks, mpi, run):
            return status
    else:
        print(f"{folder.name}: computed already", file=sys.stderr)
    if lack_of(run, folder).need is not Need.NOTHING:
        measure_run(folder, run)
    return 0


def _simulate(folder: Path, ranks: int, mpi: str, run: Run | None = None) -> int:
    """Compute a run; the exit status."""
    with computing(folder) as lock, _asked_to_end() as is_asked:
        if (folder / OUTCOME_FILE).exists():
            return 0  # finished meanwhile by a process that outlived its own Snakemake
        if ranks > 1:
            status = _in_ranks(folder, ranks, mpi, lock)
        else:
            run, before = run or read_run(folder / "scenario.yaml"), _loaded()
            try:
                status = simulate(folder, run)
            except OSError as error:
                from sandmould.engines.driver import DISK_ERRORS  # slow to import

                if error.errno not in DISK_ERRORS:
                    raise
                print(f"{run.run}: the disk refused. {error}", file=sys.stderr)
                return RESTARTABLE_EXIT
            _keep_loaded(run.scenario, before)
        return ASKED_EXIT if status == RESTARTABLE_EXIT and is_asked() else status


@contextlib.contextmanager
def _asked_to_end() -> Iterator[Callable[[], bool]]:
    """Note whether SIGTERM comes, whoever handles it."""
    read, write = os.pipe()
    for end in (read, write):
        os.set_blocking(end, False)
    before = signal.set_wakeup_fd(write)

    def is_asked() -> bool:
        with contextlib.suppress(BlockingIOError):
            return signal.SIGTERM in os.read(read, 4096)
        return False

    yield is_asked
    signal.set_wakeup_fd(before)
    signal.signal(signal.SIGTERM, signal.SIG_DFL)  # no stage is left that could stop softly
    for end in (read, write):
        os.close(end)


def _in_ranks(folder: Path, ranks: int, mpi: str, lock: TextIO) -> int:
    """Compute a run in several processes; the exit status, as a shell gives it."""
    launcher, *options = mpi.split()
    own = Path(sys.executable).parent / launcher  # that of our own environment, if it has it
    command = [str(own) if own.exists() else launcher, *options, "-n", str(ranks)]
    process = subprocess.Popen(
        [*command, sys.executable, "-m", "sandmould.execution.simulate", str(folder)],
        preexec_fn=end_with_parent,
        # It holds the run's lock, too: killed, this process may end before it.
        pass_fds=(lock.fileno(),),
    )

    def stop(number: int, frame: FrameType | None) -> None:
        process.terminate()

    signal.signal(signal.SIGTERM, stop)
    status = process.wait()
    return status if status >= 0 else 128 - status


def load_for(scenario: Any) -> None:
    """Load what computes and measures runs like one, and the compiled code that they called."""
    kind = kind_of(scenario)
    kind.execution.load_computing(scenario)
    kind.execution.load_measuring(scenario)
    with contextlib.suppress(Exception):  # a damaged list; what is not loaded is compiled later
        if _COMPILING in sys.modules:
            from sandmould.called_kernels import kept_kernels, load_kernels

            load_kernels(kept_kernels(_class_of(scenario)) - _loaded())
    kind.planning.template_hash(scenario)
    for asked_once in (commit, versions, processor):
        asked_once()


def _loaded() -> set[str]:
    """Compiled code that this process has called; what compiles is not imported to ask."""
    if _COMPILING not in sys.modules:
        return set()
    from sandmould.called_kernels import loaded_kernels

    return loaded_kernels()


def _keep_loaded(scenario: Any, before: set[str]) -> None:
    """Note for later servers what a run has called that was not loaded before."""
    if new := _loaded() - before:
        from sandmould.called_kernels import keep_kernels

        keep_kernels(_class_of(scenario), new)


def _class_of(scenario: Any) -> str:
    engine, dimension = kind_of(scenario).planning.speed_class(scenario)
    return f"{engine}_{dimension}"
