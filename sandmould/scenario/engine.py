"""The engines by name, and which of them computes a scene."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Annotated, Any

from pydantic import GetCoreSchemaHandler
from pydantic_core import CoreSchema, core_schema

from sandmould.scenario.quantity import Section, quantity
from sandmould.scenario.sand import ARGUED


@dataclass(frozen=True)
class EngineEntry:
    """What a study's file may say of an engine; all else stands in the engine's own folder."""

    name: str
    """Folder of ``sandmould/engines``, which offers an ``EngineModule``, and of ``templates``."""
    reads_decks: bool
    """Whether people write decks of their own for it."""


ENGINES = (
    EngineEntry("lammps", reads_decks=True),
    EngineEntry("liggghts", reads_decks=True),
    EngineEntry("reference", reads_decks=False),
)
"""The registry: an engine is added by one line, its folder and its templates."""
ENGINE_NAMES = tuple(engine.name for engine in ENGINES)


@dataclass(frozen=True)
class _OneOf:
    """Lets a text be one of some names, as ``Literal`` does of names that are written out."""

    names: tuple[str, ...]

    def __get_pydantic_core_schema__(
        self, source: Any, handler: GetCoreSchemaHandler
    ) -> CoreSchema:
        return core_schema.literal_schema(list(self.names))


EngineName = Annotated[str, _OneOf(ENGINE_NAMES)]
"""Name of an engine."""
DeckReader = Annotated[str, _OneOf(tuple(e.name for e in ENGINES if e.reads_decks))]
"""Name of an engine that reads decks of the user's own."""


class Engine(Section):
    """Which engine computes the scene, and with how many ranks."""

    name: EngineName = quantity("lammps", "Engine that computes the scene.", source=ARGUED)
    ranks: int = quantity(
        1, "MPI ranks of one run, or threads of the reference engine.", source=ARGUED, ge=1, le=4096
    )
