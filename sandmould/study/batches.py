"""Runs that share one job, where a job costs more than a run."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

from sandmould.study.expand import Run
from sandmould.study.plan import planned_grain_steps

RATE = {"reference": 1.5e7, "lammps": 2.5e6, "liggghts": 3e6}
"""Grain-steps per second of one core in 2D that batches are filled by (docs/speed.md); fixed, so
that a study has the same batches on every machine."""
IN_3D = 0.4
"""Share of that in 3D."""


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

    def close(kind: tuple[str, int]) -> None:
        chosen = kept.pop(kind)
        filled.pop(kind)
        batches.append(Batch(chosen[0].run, tuple(chosen)))

    for run in runs:
        engine = run.scenario.engine
        kind = (str(engine.name), engine.ranks)
        kept.setdefault(kind, []).append(run)
        rate = RATE[engine.name] * engine.ranks * (IN_3D if run.scenario.dimension == 3 else 1.0)
        one_s = planned_grain_steps(run.scenario) / rate
        filled[kind] = filled.get(kind, 0.0) + one_s
        if filled[kind] >= wall_s:
            close(kind)
    for kind in list(kept):
        close(kind)
    return batches
