"""The kind of study that runs a deck of the user's own."""

from __future__ import annotations

from typing import Annotated, ClassVar, Literal

from pydantic import Field

from sandmould.definition.study import StudyBesideSand, kind_key
from sandmould.kinds.kind import Kind, opened_later
from sandmould.scenario.own_deck import OwnDeck
from sandmould.scenario.quantity import quantity
from sandmould.scenario.sand import ARGUED


class DeckStudy(StudyBesideSand):
    """A study of a deck of the user's own."""

    kind: Literal["deck"] = kind_key("deck")
    material: ClassVar[str | None] = None  # type: ignore[misc]
    scenario: OwnDeck = Field(
        ..., description="What the template is given, and what is read from its log."
    )
    trust_deck: bool = quantity(
        False,
        "true lets the runs execute a deck that is not shipped: it is a program that can read and "
        "change your files.",
        source=ARGUED,
    )
    allowed_folders: tuple[Annotated[str, Field(min_length=1)], ...] = quantity(
        (),
        "Folders, seen from the study's file, that template and files may lie in beside the "
        "study's own folder.",
        source="user",
    )

    @property
    def trusts_program(self) -> bool:
        """As the user states it."""
        return self.trust_deck

    @property
    def more_folders(self) -> tuple[str, ...]:
        """As the user states them."""
        return self.allowed_folders


DECK: Kind[OwnDeck] = Kind(
    name="deck",
    scenario=OwnDeck,
    study=DeckStudy,
    open_planning=opened_later("sandmould.kinds.deck.planning", "DeckPlanning"),
    open_execution=opened_later("sandmould.kinds.deck.execution", "DeckExecution"),
    draws_by_lot=True,
)
