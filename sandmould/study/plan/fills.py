"""Fills that runs share: runs alike up to their first vibration compute that part once."""

from __future__ import annotations

import json
from collections.abc import Sequence
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

    Parameters
    ----------
    runs : sequence of Run
        All of a study, those of earlier rounds included: what is appended shares with them.
    planning : Planning
        Of the study's kind.

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


def own_work(run: Run) -> float:
    """Planned work that a run does itself: all but that of a fill that it shares."""
    planning = kind_of(run.scenario).planning
    whole = planning.planned_work(run.scenario)
    return whole - planning.planned_work(planning.fill(run.scenario)) if run.fill else whole


def predicted_s(run: Run) -> float:
    """Wall time of what a run does itself, at speeds that are the same on every machine."""
    planning = kind_of(run.scenario).planning
    share = own_work(run) / planning.planned_work(run.scenario) if run.fill else 1.0
    return share * planning.predicted_s(run.scenario)
