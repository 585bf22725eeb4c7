"""A worker: it loads all libraries once and forks a process for each run.

A run that crashes takes no other with it. MPI, engines and threads begin in the run's process.
"""

from __future__ import annotations

import contextlib
import gc
import tempfile
from collections.abc import Callable, Iterator, Sequence
from functools import partial
from pathlib import Path
from typing import Any, TextIO

from sandmould.compiled import load_kernels, loaded_kernels
from sandmould.runs.provenance import commit, processor, versions
from sandmould.scenario.bad_input import BadInputError
from sandmould.scenario.module_main import in_a_sentence
from sandmould.study.definition.run import Run
from sandmould.study.forked import ForkedProcess, Work
from sandmould.study.kinds.registry import kind_of
from sandmould.study.plan.plan_files import read_run
from sandmould.study.process import listen, passed_on, watch
from sandmould.study.simulate import measure, simulate, write_crash


def load(folders: Sequence[Path], ahead: bool = True) -> None:
    """Load what runs need; all of a batch are of one kind and engine.

    Parameters
    ----------
    folders : sequence of Path
        Of the runs.
    ahead : bool
        Load what measures, too; else that is done while the first run is computed.
    """
    with contextlib.suppress(BadInputError):  # the run says so itself
        scenario = read_run(folders[0] / "scenario.yaml").scenario
        execution = kind_of(scenario).execution
        execution.load_computing(scenario)
        if ahead:
            _load_rest(scenario)


def _load_rest(scenario: Any) -> None:
    """Load what is not needed before a run begins."""
    kind_of(scenario).execution.load_measuring(scenario)
    for asked_once in (commit, versions, processor):
        asked_once()
    gc.freeze()  # a child that looks through what is here would copy it


def compute_forked(run: Run, folder: Path, log: Path) -> None:
    """Compute a run in a process that is forked from this one; see ``process.watch``."""

    def crash(detail: str) -> None:
        writer = ForkedProcess(partial(write_crash, folder, detail))
        with log.open("a", encoding="utf-8") as log_file:
            status, said = listen(writer, log_file, folder.name)
        if status:
            raise RuntimeError(said)

    with _kernels_taken_over() as noted:

        def start(lock: TextIO) -> ForkedProcess:
            return ForkedProcess(noted(simulate, folder))

        watch(folder, log, start, crash, partial(_load_rest, run.scenario))


def measure_forked(run: Run, folder: Path, log: Path) -> None:
    """Measure a run in a process that is forked from this one.

    Raises
    ------
    RuntimeError
        With the last words of one that did not end well.
    """
    with _kernels_taken_over() as noted, log.open("a", encoding="utf-8") as log_file:
        process = ForkedProcess(noted(measure, run, folder))
        with passed_on(process):
            status, said = listen(process, log_file, run.run)
    if status:
        raise RuntimeError(f"measuring ended with status {status}: {said}")


@contextlib.contextmanager
def _kernels_taken_over() -> Iterator[Callable[..., Work]]:
    """Load what a forked process loaded, so that the next finds it; gives what wraps its work.

    Reading compiled code takes longer than a short run.
    """
    before = loaded_kernels()
    with tempfile.TemporaryFile("w+", encoding="utf-8") as file:

        def work(function: Callable[..., int | None], *given: Any) -> int | None:
            status = in_a_sentence(function, *given)
            file.write("\n".join(loaded_kernels() - before))
            file.flush()
            return status

        yield lambda function, *given: partial(work, function, *given)
        file.seek(0)
        load_kernels(file.read().splitlines())  # none of one that crashed
