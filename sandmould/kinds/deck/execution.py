"""How a deck of the user's own is run and measured."""

from __future__ import annotations

import math
from pathlib import Path

from sandmould.definition.run import Run
from sandmould.kinds.deck.own import computation
from sandmould.kinds.deck.own import deck as own_deck
from sandmould.kinds.deck.own.measures import draw_measures, measure_deck
from sandmould.kinds.kind import Execution
from sandmould.runs.files import write_text
from sandmould.runs.products import Computed, Cost
from sandmould.scenario.own_deck import OwnDeck


class DeckExecution(Execution[OwnDeck]):
    """See ``Execution``."""

    products = ("series.tsv", own_deck.OUTPUT)

    def render(self, run: Run, folder: Path) -> None:
        """Write the deck as the engine reads it at the beginning."""
        own_deck.check_unchanged(run.scenario)
        text = own_deck.render(run.scenario, run.run, run.study)
        write_text(folder / "deck.in", text)

    def compute(self, run: Run, folder: Path) -> Computed:
        """Have the engine read the deck."""
        return computation.compute(run.scenario, folder, run.run, run.study)

    def complete(self, scenario: OwnDeck, work: Path) -> None:
        """Make the table of what the log of a broken run holds."""
        computation.series(work).to_csv(work / "series.tsv", sep="\t", index=False)

    def no_cost(self, scenario: OwnDeck) -> Cost:
        """Cost before the engine has started."""
        return Cost(scenario.engine.name, scenario.engine.ranks, math.nan, math.nan)

    def measure(self, run: Run, folder: Path) -> None:
        """Write the measures against time."""
        measure_deck(run.scenario, folder)

    def export(self, run: Run, folder: Path) -> None:
        """Draw the measures against time."""
        draw_measures(run.scenario, folder)
