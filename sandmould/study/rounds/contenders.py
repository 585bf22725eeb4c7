"""Rounds of replicates: more runs of the settings that may be the best, and of no others."""

from __future__ import annotations

from dataclasses import dataclass

import pandas as pd

from sandmould.definition.study import Study
from sandmould.definition.sweep import Point
from sandmould.runs.columns import REPLICATE
from sandmould.runs.formatting import number
from sandmould.statistics.settings import setting_rows
from sandmould.statistics.verdict import Verdict, compare_settings


@dataclass(frozen=True)
class Contenders:
    """Settings that may be the best, the best mean first, then nearest first."""

    verdict: Verdict
    points: tuple[Point, ...]
    replicates: tuple[int, ...]
    """Planned so far, finished or not."""

    @property
    def half_width(self) -> float:
        """Of the 95 % interval of the difference between the two best settings."""
        low, high = self.verdict.ci
        second = self.verdict.runner_up
        return (high - low) / 2.0 * (second.mean if self.verdict.by_factor and second else 1.0)

    def more(self, runs: int) -> tuple[tuple[Point, int], ...]:
        """Bring the contenders to equally many replicates; where they are, to one more.

        ``runs``: the most that are added; the nearest to the best come first.
        """
        fewest, most = min(self.replicates), max(self.replicates)
        goal = most if fewest < most else most + 1
        lacking = [
            (point, replicate)
            for point, planned in zip(self.points, self.replicates, strict=True)
            for replicate in range(planned + 1, goal + 1)
        ]
        return tuple(lacking[:runs])


def find_contenders(summary: pd.DataFrame, study: Study, keys: list[str]) -> Contenders | None:
    """Find the settings that runs so far do not rule out; None where no two can be compared.

    Settings are compared as in the report, so that one that gets no more runs is one that the
    report calls worse.

    ``summary``: one row a run of the sweep and of all rounds so far.
    """
    objective = study.objective
    verdict = compare_settings(summary, keys, objective.measure, objective.better)
    if verdict.best is None or not any(c.tested for c in verdict.comparisons):
        return None
    labels = [verdict.best.label, *(c.other for c in verdict.comparisons if not c.separated)]
    place = {setting.label: setting.values for setting in verdict.settings}
    planned = {
        tuple(values.items()): int(summary[REPLICATE].iloc[rows].max())
        for values, rows in setting_rows(summary, keys)
    }
    points = tuple(dict(place[label]) for label in labels)
    return Contenders(verdict, points, tuple(planned[tuple(p.items())] for p in points))


def best_points(summary: pd.DataFrame, study: Study, keys: list[str]) -> tuple[Point, ...]:
    """The setting with the best mean and the next best, or what there is of them."""
    verdict = compare_settings(summary, keys, study.objective.measure, study.objective.better)
    if verdict.best is None:
        return ()
    ranked = [verdict.best.label, *(c.other for c in verdict.comparisons)]
    return tuple(dict(verdict.setting(label).values) for label in ranked[:2])


def why_decided(contenders: Contenders, half_width: float | None) -> str:
    """Say why no more replicates are due; empty where they are."""
    if len(contenders.points) == 1:
        return "One setting is left: all others are ruled out."
    if half_width is not None and contenders.half_width <= half_width:
        return (
            "The difference between the two best settings is known as well as asked: "
            f"to {number(contenders.half_width, 2)} either way."
        )
    return ""
