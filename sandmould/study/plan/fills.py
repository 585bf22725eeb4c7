"""Fills that runs share: runs alike up to their first vibration compute that part once."""

from __future__ import annotations

import functools
import json
from collections.abc import Callable, Sequence
from dataclasses import replace
from typing import Any

from sandmould.definition.run import FILL, Run
from sandmould.kinds.kind import Planning
from sandmould.kinds.registry import kind_of
from sandmould.runs.hashing import scenario_hash

LEAST_RUNS = 2
"""A fill that one run needs is computed by that run."""


def share_fills(runs: Sequence[Run], planning: Planning[Any]) -> tuple[list[Run], list[Run]]:
    """Find the fills that runs have in common.

    ``runs``: all of a study, those of earlier rounds included: what is appended shares with them.

    Returns
    -------
    runs : list of Run
        As given, each with the name of its fill where it shares one.
    fills : list of Run
        Each with the scene up to the first vibration; the replicate is that of its runs.
    """
    alike: dict[tuple[str, int], list[int]] = {}
    of_point: dict[str, str | None] = {}
    for place, run in enumerate(runs):
        # Replicates of a point differ in their seed alone.
        point = f"{run.part} {json.dumps(run.parameters)}"
        if point not in of_point:
            fill = planning.fill(run.scenario)
            seedless = fill and fill.model_copy(update={"seed": 0})
            of_point[point] = seedless and scenario_hash(seedless)
        key = of_point[point]
        if key is not None:
            alike.setdefault((key, run.seed), []).append(place)
    shared, fills = list(runs), []
    for places in alike.values():
        if len(places) < LEAST_RUNS:
            continue
        first = runs[places[0]]
        scenario: Any = planning.fill(first.scenario)
        name = f"{FILL}_r{first.replicate}_{scenario_hash(scenario)[:6]}"
        fills.append(replace(first, run=name, parameters={}, scenario=scenario, part=FILL))
        for place in places:
            shared[place] = replace(runs[place], fill=name)
    return shared, fills


def asked_once(asked: Callable[[Run], float]) -> Callable[[Run], float]:
    """Ask a question about runs once of all that differ in their seed alone."""
    known = dict[str, float]()

    @functools.wraps(asked)
    def answer(run: Run) -> float:
        if run.alike not in known:
            known[run.alike] = asked(run)
        return known[run.alike]

    return answer


@asked_once
def planned_work(run: Run) -> float:
    """Planned work of a run, with that of a fill that it shares."""
    return kind_of(run.scenario).planning.planned_work(run.scenario)


@asked_once
def own_work(run: Run) -> float:
    """Planned work that a run does itself: all but that of a fill that it shares."""
    planning = kind_of(run.scenario).planning
    shared = planning.planned_work(planning.fill(run.scenario)) if run.fill else 0.0
    return planned_work(run) - shared


@asked_once
def predicted_s(run: Run) -> float:
    """Wall time of what a run does itself, at speeds that are the same on every machine."""
    share = own_work(run) / planned_work(run) if run.fill else 1.0
    return share * kind_of(run.scenario).planning.predicted_s(run.scenario)


@asked_once
def beside_s(run: Run) -> float:
    """Wall time that a run takes beside its work."""
    return kind_of(run.scenario).planning.beside_s(run.scenario)
