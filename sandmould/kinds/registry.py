"""All kinds of studies."""

from __future__ import annotations

from typing import Any

from sandmould.bad_input import BadInputError, Problem
from sandmould.kinds.deck.kind import DECK
from sandmould.kinds.flow.kind import FLOW
from sandmould.kinds.kind import Kind, ScenarioT
from sandmould.kinds.sand.kind import SAND
from sandmould.kinds.solidification.kind import SOLIDIFICATION

KINDS: dict[str, Kind[Any]] = {
    kind.name: kind for kind in (SAND, DECK, SOLIDIFICATION, FLOW)
}  # fmt: skip
DEFAULT_KIND = SAND
"""That of a study that states none."""
_OF_SCENARIO: dict[type, Kind[Any]] = {kind.scenario: kind for kind in KINDS.values()}


def kind_named(name: object, file: str = "") -> Kind[Any]:
    """The kind of a study by its name.

    Raises
    ------
    BadInputError
        When no kind has the name.
    """
    if isinstance(name, str) and name in KINDS:
        return KINDS[name]
    *first, last = (repr(kind) for kind in KINDS)
    raise BadInputError([Problem("kind", name, f"one of {', '.join(first)} or {last}", file)])


def kind_of(scenario: ScenarioT) -> Kind[ScenarioT]:
    """The kind that a scenario belongs to."""
    return _OF_SCENARIO[type(scenario)]
