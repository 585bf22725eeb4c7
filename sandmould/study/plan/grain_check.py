"""Runs with coarser grains, as many as the price allows."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

from sandmould.definition.run import Run
from sandmould.definition.sweep import Point, points
from sandmould.kinds.kind import Planning
from sandmould.kinds.registry import kind_named
from sandmould.runs.columns import SWEEP
from sandmould.runs.formatting import listed, setting_text
from sandmould.statistics.grain_check import FACTOR, FEWEST
from sandmould.study.plan.expand import as_planned, coarser_runs
from sandmould.study.plan.fills import own_work, share_fills
from sandmould.study.plan.load_study import OpenStudy
from sandmould.study.robustness.controls import COARSER


def affordable_runs(study: OpenStudy, best: Sequence[Point], planned: Sequence[Run]) -> list[Run]:
    """Runs with coarser grains at the best setting and the next.

    Both with equally many replicates, or the best alone, or none: fewer than ``FEWEST`` tell
    nothing. ``best``: the best first; ``planned``: of the sweep and its rounds.
    """
    planning = kind_named(study.study.kind).planning
    allowed = study.study.grain_price_share * _work(planned, planning)
    of_points, swept = [], points(study.study.sweep, study.study.scenario)
    for point in (as_planned(chosen, swept) for chosen in best[:2]):
        of_point = {r.replicate for r in planned if r.part == SWEEP and r.parameters == point}
        of_points.append(coarser_runs(study, point, sorted(of_point)))
    for chosen in (of_points, of_points[:1]):
        for each in range(min(map(len, chosen), default=0), FEWEST - 1, -1):
            runs = [run for of_point in chosen for run in of_point[:each]]
            if _work(runs, planning) <= allowed:
                return runs
    return []


def coarser_text(runs: Sequence[Run]) -> str:
    """Which settings are computed again with coarser grains, as a line; empty where none is."""
    added = [run for run in runs if run.part == COARSER.part]
    settings = dict.fromkeys(setting_text(run.parameters) for run in added)
    again = listed([setting for setting in settings if setting])
    said = f"Again with grains {FACTOR:g} times as large{again and ': '}{again}."
    return said if added else ""


def _work(runs: Sequence[Run], planning: Planning[Any]) -> float:
    """Planned work of runs, with that of the fills that they share once."""
    shared, fills = share_fills(runs, planning)
    return sum(map(own_work, (*shared, *fills)))
