"""Runs that share one job, where a job costs more than a run."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

from sandmould.study.expand import Run
from sandmould.study.kinds.kind import kind_of


@dataclass(frozen=True)
class Batch:
    """Runs that one job computes one after the other; all need as many cores."""

    name: str
    runs: tuple[Run, ...]


def plan_batches(runs: Sequence[Run], wall_s: float) -> list[Batch]:
    """Share runs out among jobs.

    A batch is closed once it is predicted to last long enough. Its name is that of its first run,
    so that runs that are appended later move nothing but the last batch.

    Parameters
    ----------
    runs : sequence of Run
    wall_s : float, s
    """
    batches: list[Batch] = []
    kept: dict[tuple[str, int], list[Run]] = {}
    filled: dict[tuple[str, int], float] = {}

    def close(alike: tuple[str, int]) -> None:
        chosen = kept.pop(alike)
        filled.pop(alike)
        batches.append(Batch(chosen[0].run, tuple(chosen)))

    for run in runs:
        kind, engine = kind_of(run.scenario), run.scenario.engine
        alike = (str(engine.name), engine.ranks)
        kept.setdefault(alike, []).append(run)
        filled[alike] = filled.get(alike, 0.0) + kind.predicted_s(run.scenario)
        if filled[alike] >= wall_s:
            close(alike)
    for alike in list(kept):
        close(alike)
    return batches
