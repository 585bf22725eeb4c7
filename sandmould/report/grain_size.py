"""What the report says of the size of the model's grains, from runs with coarser ones."""

from __future__ import annotations

from dataclasses import dataclass

import pandas as pd

from sandmould.definition.study import Study
from sandmould.kinds.sand.narrow import narrow_spaces
from sandmould.report.tables import Cell, Column, Table
from sandmould.runs.columns import RUN, VIBRATION_TIME_S, during_vibration
from sandmould.runs.formatting import display_number, display_range, name_of
from sandmould.runs.templates import sentences
from sandmould.scenario.scenario import Scenario
from sandmould.statistics.decision import aims_beside
from sandmould.statistics.grain_change import GrainChange, grain_changes, order_of
from sandmould.statistics.grain_check import FACTOR
from sandmould.statistics.over_time import first_reach_s
from sandmould.study.collect import Collected
from sandmould.study.robustness.controls import COARSER

FILLED = 0.9
"""Share of its last fill at which a cavity counts as filled."""
FILLED_S = "filled_to_nine_tenths_s"
ALSO = (
    "bed_solid_fraction", "loose_fraction", "loose_under_fraction", "largest_loose_zone_m3",
    "pattern_largest_displacement_m",
)  # fmt: skip
"""Measures that the table has beside those that the study asks for."""


@dataclass(frozen=True)
class GrainSizePages:
    """What the section shows."""

    short: tuple[str, ...]
    """For the first screen."""
    sentences: tuple[str, ...]
    table: Table
    factor = f"{FACTOR:g}"


def grain_size_pages(
    study: Study, collected: Collected, scenario: Scenario, best: str
) -> GrainSizePages | None:
    """Compare the runs with coarser grains with those of the sweep; None without such runs.

    ``scenario``: of the run that is shown; ``best``: label of the best setting.
    """
    objective = study.objective
    aims = aims_beside(objective.measure, objective.beside, collected.summary)
    asked = (objective.measure, *(aim.measure for aim in aims))
    measures = [m for m in dict.fromkeys((*asked, *ALSO)) if m in collected.summary]
    summary = _with_times(collected, objective.measure)
    measures += [column for column in (FILLED_S,) if column in summary]
    changes = list(grain_changes(summary, collected.keys, measures, COARSER.part))
    of_objective = sorted(
        (c for c in changes if c.measure == objective.measure), key=lambda c: c.label != best
    )
    if not of_objective or of_objective[0].label != best:
        return None
    narrow = [name for space in narrow_spaces(scenario) for name in space.names]
    beside = [c for c in changes if c.measure in asked[1:] and c.label == best]
    first, *others = of_objective
    order = order_of(first, others[0], objective.better) if others else ""
    short, said = (
        sentences(
            "grain_size.j2",
            changes=of_objective,
            shown=[*told, *beside],
            factor=f"{FACTOR:g}",
            two=bool(others),
            order=order,
            narrow=narrow,
        )
        for told in (of_objective[:1], of_objective)
    )
    return GrainSizePages(short, said, _table(changes))


def _with_times(collected: Collected, measure: str) -> pd.DataFrame:
    """The summary with the time in which a cavity fills, where the measure is a fill."""
    if not measure.endswith("_fill_fraction"):
        return collected.summary
    times_s = {
        run: first_reach_s(rows[VIBRATION_TIME_S], rows[measure], FILLED * rows[measure].iloc[-1])
        for run, rows in during_vibration(collected.curves).groupby(RUN)
    }
    return collected.summary.assign(**{FILLED_S: collected.summary[RUN].map(times_s)})


def _table(changes: list[GrainChange]) -> Table:
    columns = (
        Column("setting", False),
        Column("measure", False),
        Column("grains of the study"),
        Column(f"{FACTOR:g} times as large"),
        Column("change, 95 %"),
        Column(f"predicted {FACTOR:g} times finer, 90 %"),
    )
    rows = tuple(
        (
            Cell(each.label or "–", each.label),
            Cell(name_of(each.measure), each.measure),
            Cell(display_number(each.measure, mean := float(each.own.mean())), repr(mean)),
            Cell(display_number(each.measure, mean + each.change), repr(mean + each.change)),
            Cell(display_range(each.measure, *each.ci), repr(each.change)),
            Cell(display_range(each.measure, *each.finer), repr(sum(each.finer) / 2)),
        )
        for each in changes
    )
    return Table(columns, rows, tuple(each.is_seen for each in changes))
