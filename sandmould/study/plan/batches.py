"""Runs that share one job, where a job costs more than a run."""

from __future__ import annotations

from collections.abc import Container, Iterable, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import NamedTuple

from sandmould.study.definition.run import FILL, FILLS, LAST_MEASURED, Run
from sandmould.study.kinds.registry import kind_of
from sandmould.study.plan.fills import predicted_s

START_S = 0.3
"""What a run takes beside its steps: its process and its measures (docs/scaling.md)."""


def is_done(folder: Path) -> bool:
    """Whether a run is computed and measured; a failed one is, too. Fills are not measured."""
    last = "outcome.json" if folder.parent.name == FILLS else LAST_MEASURED
    return all((folder / name).exists() for name in ("outcome.json", last))


@dataclass(frozen=True)
class Batch:
    """Runs that one job computes, so many at a time; all need as many cores."""

    name: str
    runs: tuple[Run, ...]
    side_by_side: int = 1


class _Alike(NamedTuple):
    """What runs of one batch have in common."""

    engine: str
    threads: int
    ranks: int


def planned_wall_s(run: Run) -> float:
    """Wall time that batches count on for a run, in a job that is there already."""
    return START_S + predicted_s(run)


def plan_batches(runs: Sequence[Run], wall_s: float, cores: int = 1) -> list[Batch]:
    """Share runs out among jobs.

    A batch is closed once it is predicted to last long enough. Its name is that of its first run,
    so that runs that are appended later move nothing but the last batch.

    Parameters
    ----------
    runs : sequence of Run
    wall_s : float, s
    cores : int
        That a job should have; runs that leave some of them free are computed side by side. One
        run under MPI has a job's cores for itself.
    """
    batches: list[Batch] = []
    waiting: dict[_Alike, list[Run]] = {}
    filled: dict[_Alike, float] = {}

    def beside(alike: _Alike) -> int:
        return 1 if alike.ranks > 1 else max(1, cores // alike.threads)

    def close(alike: _Alike) -> None:
        chosen = waiting.pop(alike)
        filled.pop(alike)
        batches.append(Batch(chosen[0].run, tuple(chosen), min(beside(alike), len(chosen))))

    for run in runs:
        planning, scenario = kind_of(run.scenario).planning, run.scenario
        engine, _ = planning.speed_class(scenario)
        alike = _Alike(engine, planning.threads(scenario), planning.ranks(scenario))
        waiting.setdefault(alike, []).append(run)
        filled[alike] = filled.get(alike, 0.0) + planned_wall_s(run)
        if filled[alike] >= wall_s * beside(alike):
            close(alike)
    for alike in list(waiting):
        close(alike)
    return batches


def mark_done(batches: Iterable[Batch], lacking: Container[str], folder: Path) -> None:
    """Mark batches whose runs lack nothing, such as unpacked ones, so that no job looks at them.

    Parameters
    ----------
    batches : iterable of Batch
    lacking : container of str
        Names of runs that lack something.
    folder : Path
        ``results/<study>``.
    """
    for batch in batches:
        if batch.runs[0].part == FILL:
            continue  # one that no run waits for is not there
        mark = folder / "batches" / f"{batch.name}.done"
        if not mark.exists() and not any(run.run in lacking for run in batch.runs):
            mark.parent.mkdir(exist_ok=True)
            mark.touch()


def alone(runs: Sequence[Run], batches: Sequence[Batch]) -> list[str]:
    """Names of runs that are in no batch."""
    shared = {run.run for batch in batches for run in batch.runs}
    return [run.run for run in runs if run.run not in shared]
