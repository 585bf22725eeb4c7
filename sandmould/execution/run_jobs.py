"""What jobs of runs do, each a function of plain values: a job may ask another process for it."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

import sandmould.runs.one_blas_thread  # noqa: F401
from sandmould.execution import batch_job
from sandmould.execution.job_log import to_log
from sandmould.execution.simulate import measure, render
from sandmould.study.plan.plan_files import read_run


def render_run(scenario: str, log: str) -> None:
    """Render the deck of a run.

    Parameters
    ----------
    scenario : str
        Path of its ``scenario.yaml``.
    log : str
        Path of the file that takes what is printed.
    """
    with to_log(log):
        render(read_run(Path(scenario)), Path(scenario).parent)


def simulate_run(scenario: str, log: str, ranks: int, mpi: str) -> None:
    """Compute a run whose deck is there; ``mpi`` starts its ranks."""
    run, folder = read_run(Path(scenario)), Path(scenario).parent
    batch_job.simulate_run(run, folder, Path(log), ranks, mpi)


def measure_run(scenario: str, log: str) -> None:
    """Measure a run that has ended."""
    with to_log(log):
        measure(read_run(Path(scenario)), Path(scenario).parent)


def compute_batch(
    scenarios: Sequence[str], log: str, ranks: int, mpi: str, side_by_side: int
) -> None:
    """Render, compute and measure several runs; see ``batch_job``."""
    folders = [Path(scenario).parent for scenario in scenarios]
    batch_job.compute_batch(folders, Path(log), ranks, mpi, side_by_side)
