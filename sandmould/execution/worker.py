"""A worker: it loads all libraries once and forks a process for each run.

A run that crashes takes no other with it. MPI, engines and threads begin in the run's process.
"""

from __future__ import annotations

import contextlib
import gc
import signal
import tempfile
from collections.abc import Callable, Iterator
from functools import partial
from pathlib import Path
from typing import Any, TextIO

from sandmould.called_kernels import keep_kernels, kept_kernels, load_kernels, loaded_kernels
from sandmould.definition.run import FILL, Run
from sandmould.execution.forked import ForkedProcess, Work
from sandmould.execution.process import listen, passed_on, watch
from sandmould.execution.simulate import measure, simulate, write_crash
from sandmould.kinds.registry import kind_of
from sandmould.module_main import in_a_sentence
from sandmould.runs.provenance import commit, processor, versions

_LOADED: set[str] = set()
"""Classes of runs whose measuring is loaded."""


def load(scenario: Any, ahead: bool = True) -> None:
    """Load what runs of one kind and engine need.

    Parameters
    ----------
    scenario : scenario
        Of any of them.
    ahead : bool
        Load what measures, too; else that is done while the first run is computed.
    """
    kind_of(scenario).execution.load_computing(scenario)
    load_kept(scenario)
    if ahead:
        _load_rest(scenario)


def load_kept(scenario: Any) -> None:
    """Load compiled code that runs like this one have needed: it takes longer than a short run."""
    with contextlib.suppress(Exception):  # a damaged file; what is not loaded is compiled later
        load_kernels(kept_kernels(_class_of(scenario)) - loaded_kernels())


def _load_rest(scenario: Any) -> None:
    """Load what is not needed before a run begins, once for all runs like this one."""
    if _class_of(scenario) in _LOADED:
        return
    _LOADED.add(_class_of(scenario))
    kind = kind_of(scenario)
    kind.execution.load_measuring(scenario)
    kind.planning.template_hash(scenario)
    for asked_once in (commit, versions, processor):
        asked_once()
    gc.freeze()  # a child that looks through what is here would copy it


def compute_forked(run: Run, folder: Path, log: Path, and_measure: bool = False) -> None:
    """Compute a run in a process that is forked from this one; see ``process.watch``.

    Parameters
    ----------
    run : Run
    folder : Path
    log : Path
    and_measure : bool
        Measure it in the same process, which may fail for itself: a fork takes a tenth of a short
        run.
    """

    def crash(detail: str) -> None:
        writer = ForkedProcess(partial(write_crash, folder, detail))
        with log.open("a", encoding="utf-8") as log_file:
            status, said = listen(writer, log_file, folder.name)
        if status:
            raise RuntimeError(said)

    with _kernels_taken_over(run) as noted:

        def start(lock: TextIO) -> ForkedProcess:
            return ForkedProcess(noted(_computed, run, folder, and_measure))

        load_rest = partial(_load_rest, run.scenario) if and_measure else _nothing
        watch(folder, log, start, crash, load_rest)


def _nothing() -> None:
    """Load nothing meanwhile."""


def _computed(run: Run, folder: Path, and_measure: bool) -> int:
    """Compute a run in this process; the exit status."""
    status = simulate(folder, run)
    if status == 0 and and_measure and run.part != FILL:
        signal.signal(signal.SIGTERM, signal.SIG_DFL)  # no stage is left that could stop softly
        measure(run, folder)
    return status


def measure_forked(run: Run, folder: Path, log: Path) -> None:
    """Measure a run in a process that is forked from this one.

    Raises
    ------
    RuntimeError
        With the last words of one that did not end well.
    """
    with _kernels_taken_over(run) as noted, log.open("a", encoding="utf-8") as log_file:
        process = ForkedProcess(noted(measure, run, folder))
        with passed_on(process):
            status, said = listen(process, log_file, run.run)
    if status:
        raise RuntimeError(f"measuring ended with status {status}: {said}")


@contextlib.contextmanager
def _kernels_taken_over(run: Run) -> Iterator[Callable[..., Work]]:
    """Load what a forked process loaded, so that the next finds it; gives what wraps its work.

    It is kept for later workers, too.
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
        if new := set(file.read().splitlines()):  # none of one that crashed
            load_kernels(new)
            keep_kernels(_class_of(run.scenario), new)


def _class_of(scenario: Any) -> str:
    engine, dimension = kind_of(scenario).planning.speed_class(scenario)
    return f"{engine}_{dimension}"
