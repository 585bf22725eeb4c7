"""The job that computes a batch of runs, one after the other or several at a time."""

from __future__ import annotations

import contextlib
import itertools
import multiprocessing
import signal
import sys
from collections.abc import Callable, Sequence
from multiprocessing.process import BaseProcess
from pathlib import Path
from types import FrameType

from sandmould.bad_input import BadInputError
from sandmould.definition.run import LAST_MEASURED, Run
from sandmould.execution.process import launch
from sandmould.execution.simulate import render
from sandmould.execution.worker import compute_forked, load, measure_forked
from sandmould.runs.formatting import listed
from sandmould.runs.parent import end_with_parent
from sandmould.study.plan.batches import is_done
from sandmould.study.plan.lacking import Need, lack_of
from sandmould.study.plan.plan_files import read_run


def compute_batch(
    folders: Sequence[Path], log: Path, ranks: int, mpi: str, side_by_side: int = 1
) -> None:
    """Compute and measure runs, those left out that are there already.

    Libraries are loaded once. Each run is then computed by a process that is forked for it, or by
    one of its own where it has several ranks.

    Parameters
    ----------
    folders : sequence of Path
        Of the runs, each with its ``scenario.yaml``.
    log : Path
        Takes what all of them print.
    ranks : int
    mpi : str
    side_by_side : int
        Runs at a time.

    Raises
    ------
    SystemExit
        At the end, when a run stopped or broke: the same job continues it and redoes none.
    """
    stop = _Stop()
    log.touch()
    with contextlib.suppress(BadInputError):  # the run says so itself
        load(read_run(folders[0] / "scenario.yaml").scenario, ahead=side_by_side > 1)

    def work(place_of_next: Callable[[], int]) -> None:
        """Take the next run until none is left or the job is asked to end."""
        while not stop.requested and (place := place_of_next()) < len(folders):
            folder = folders[place]
            try:
                _compute(folder, log, ranks, mpi)
            except (Exception, SystemExit) as broken:  # one bad run must not stop the others
                print(f"{folder.name}: {broken}", file=sys.stderr, flush=True)

    before = signal.signal(signal.SIGTERM, stop)
    if side_by_side == 1:
        work(itertools.count().__next__)
    else:
        _side_by_side(side_by_side, work, stop)
    signal.signal(signal.SIGTERM, before)
    stopped = [folder.name for folder in folders if not is_done(folder)]
    if stopped:
        raise SystemExit(f"{len(stopped)} of {len(folders)} stopped or broke: {listed(stopped)}")


def _side_by_side(number: int, work: Callable[[Callable[[], int]], None], stop: _Stop) -> None:
    """Let processes work that share the libraries, which are loaded, and the list of runs."""
    fork = multiprocessing.get_context("fork")
    taken = fork.Value("i", 0)

    def place_of_next() -> int:
        with taken.get_lock():
            taken.value += 1
            return int(taken.value) - 1

    def work_beside() -> None:
        end_with_parent()
        stop.workers = []  # those are the parent's
        work(place_of_next)

    for _ in range(number):
        worker = fork.Process(target=work_beside)
        worker.start()
        stop.workers.append(worker)
    for started in stop.workers:
        started.join()


class _Stop:
    """Hears that the job is asked to end, and tells those that work beside it."""

    def __init__(self) -> None:
        self.requested = False
        self.workers: list[BaseProcess] = []

    def __call__(self, number: int, frame: FrameType | None) -> None:
        self.requested = True
        for worker in self.workers:
            worker.terminate()


def _compute(folder: Path, log: Path, ranks: int, mpi: str) -> None:
    """Do what is missing of one run."""
    run = read_run(folder / "scenario.yaml")
    need = lack_of(run, folder).need
    if need is Need.COMPUTE:
        for old in ("outcome.json", LAST_MEASURED):
            (folder / old).unlink(missing_ok=True)  # damaged, or of another scenario or deck
        render(run, folder)
        simulate_run(run, folder, log, ranks, mpi, and_measure=True)
    else:
        print(f"{folder.name}: computed already", file=sys.stderr)
    if lack_of(run, folder).need is not Need.NOTHING:
        measure_forked(run, folder, log)


def simulate_run(
    run: Run, folder: Path, log: Path, ranks: int, mpi: str, and_measure: bool = False
) -> None:
    """Compute a run whose deck is there, in a process of its own or in several.

    Raises
    ------
    SystemExit
        When it stopped early and the same command continues it.
    """
    if ranks > 1:
        launch(folder, log, ranks, mpi)
        return
    load(run.scenario, ahead=False)
    compute_forked(run, folder, log, and_measure)
