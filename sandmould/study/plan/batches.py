"""Runs that share one job, where a job costs more than a run."""

from __future__ import annotations

import json
import math
from collections.abc import Container, Iterable, Sequence
from dataclasses import dataclass
from pathlib import Path

from sandmould.definition.run import FILL, FILLS, LAST_MEASURED, Run
from sandmould.kinds.registry import kind_of
from sandmould.plain_file import read_json
from sandmould.runs.files import write_text
from sandmould.study.plan.fills import predicted_s

START_S = 0.3
"""What a run takes beside its steps: its process and its measures
(docs/developers/workflow_cost.md)."""
_LIST = "batches.json"


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


def planned_wall_s(run: Run) -> float:
    """Wall time that batches count on for a run, in a job that is there already."""
    return START_S + predicted_s(run)


def plan_batches(
    runs: Sequence[Run], wall_s: float, cores: int = 1, free_cores: int = 0, least: int = 1
) -> list[Batch]:
    """Share runs out among jobs.

    A batch is closed once it is predicted to last long enough. Its name is that of its first run,
    so that runs that are appended later move nothing but the last batch. Where it is known how many
    cores are free, batches are made so much shorter that all cores end together.

    ``cores``: that a job should have; runs that leave some of them free are computed side by side.
    One run under MPI has a job's cores for itself. ``free_cores``: that jobs find free; 0 where
    that is not known, as on a cluster. ``least``: runs that a batch should have, where it is made
    shorter.
    """
    alike: dict[tuple[str, int, int], list[Run]] = {}
    for run in runs:
        planning, scenario = kind_of(run.scenario).planning, run.scenario
        engine, _ = planning.speed_class(scenario)
        key = engine, planning.threads(scenario), planning.ranks(scenario)
        alike.setdefault(key, []).append(run)
    batches = []
    for (_, threads, ranks), chosen in alike.items():
        beside = 1 if ranks > 1 else max(1, cores // threads)
        at_once = free_cores // (threads * beside)
        parts = _filled(chosen, wall_s * beside)
        if at_once:
            long = [run for run in chosen if planned_wall_s(run) >= wall_s * beside]
            short = [run for run in chosen if planned_wall_s(run) < wall_s * beside]
            parts = [*([run] for run in long), *_even(short, len(parts), at_once, least)]
        batches += [Batch(part[0].run, tuple(part), min(beside, len(part))) for part in parts]
    return batches


def _filled(runs: Sequence[Run], wall_s: float) -> list[list[Run]]:
    """Parts that last long enough, but for the last one."""
    parts: list[list[Run]] = []
    filled_s = math.inf
    for run in runs:
        if filled_s >= wall_s:
            parts.append([])
            filled_s = 0.0
        parts[-1].append(run)
        filled_s += planned_wall_s(run)
    return parts


def _even(runs: Sequence[Run], parts: int, at_once: int, least: int) -> list[list[Run]]:
    """Parts that last equally long, at least so many, each core as many as every other."""
    if not runs:
        return []
    wanted = at_once * math.ceil(parts / at_once)
    number = max(1, min(wanted, len(runs) // least))
    whole_s = sum(planned_wall_s(run) for run in runs)
    even: list[list[Run]] = [[] for _ in range(number)]
    passed_s = 0.0
    for run in runs:
        lasts_s = planned_wall_s(run)
        even[int((passed_s + lasts_s / 2) / whole_s * number)].append(run)
        passed_s += lasts_s
    return [part for part in even if part]


def mark_done(batches: Iterable[Batch], lacking: Container[str], folder: Path) -> None:
    """Mark batches whose runs lack nothing, such as unpacked ones, so that no job looks at them.

    ``lacking``: names of runs that lack something.
    """
    for batch in batches:
        if batch.runs[0].part == FILL:
            continue  # one that no run waits for is not there
        mark = folder / "batches" / f"{batch.name}.done"
        if not mark.exists() and not any(run.run in lacking for run in batch.runs):
            mark.parent.mkdir(exist_ok=True)
            mark.touch()


def write_batches(batches: Iterable[Batch], folder: Path) -> None:
    """Write which runs share jobs, for jobs elsewhere, into ``results/<study>``."""
    listed = {each.name: [each.side_by_side, [run.run for run in each.runs]] for each in batches}
    write_text(folder / _LIST, json.dumps(listed, indent=1) + "\n")


def read_batches(runs: Iterable[Run], folder: Path) -> list[Batch]:
    """Read what ``write_batches`` wrote: batches of some runs, those not listed left out.

    Raises
    ------
    OSError, ValueError
        When it cannot be read.
    """
    by_name = {run.run: run for run in runs}
    batches = []
    for name, (beside, names) in read_json(folder / _LIST).items():
        if found := tuple(by_name[run] for run in names if run in by_name):
            batches.append(Batch(name, found, beside))
    return batches


def alone(runs: Sequence[Run], batches: Sequence[Batch]) -> list[str]:
    """Names of runs that are in no batch."""
    shared = {run.run for batch in batches for run in batch.runs}
    return [run.run for run in runs if run.run not in shared]
