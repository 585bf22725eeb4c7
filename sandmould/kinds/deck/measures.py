"""Measures of a deck of the user's own."""

from __future__ import annotations

from sandmould.runs.measures import Measure, MeasureGroup
from sandmould.scenario.own_deck import OwnDeck

MEASURES: tuple[MeasureGroup[OwnDeck], ...] = (
    MeasureGroup(
        "as scenario.measures names them",
        lambda scenario: scenario.measures,
        (Measure("<measure>", "Column of the engine's log that scenario.measures gives it."),),
    ),
)
