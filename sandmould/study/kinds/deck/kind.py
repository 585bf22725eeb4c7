"""The kind of study that runs a deck of the user's own."""

from __future__ import annotations

from typing import Literal

from pydantic import Field

from sandmould.scenario.own_deck import OwnDeck
from sandmould.study.definition.study import Study, kind_key
from sandmould.study.kinds.kind import Execution, Kind, Planning


class DeckStudy(Study):
    """A study of a deck of the user's own."""

    kind: Literal["deck"] = kind_key("deck")
    scenario: OwnDeck = Field(
        ..., description="What the template is given, and what is read from its log."
    )


def _planning() -> Planning[OwnDeck]:
    from sandmould.study.kinds.deck.planning import PLANNING

    return PLANNING


def _execution() -> Execution[OwnDeck]:
    from sandmould.study.kinds.deck.execution import EXECUTION

    return EXECUTION


DECK = Kind(
    name="deck",
    scenario=OwnDeck,
    study=DeckStudy,
    open_planning=_planning,
    open_execution=_execution,
    draws_by_lot=True,
)
