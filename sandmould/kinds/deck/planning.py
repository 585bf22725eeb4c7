"""How a deck of the user's own is planned."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

from sandmould.bad_input import Problem
from sandmould.digest import SHORT, digest
from sandmould.engines.registry import engine_module
from sandmould.kinds.deck.own import deck as own_deck
from sandmould.kinds.deck.own.deck import DECKS
from sandmould.kinds.deck.speed import DeckSpeed
from sandmould.kinds.kind import Planning, SpeedClass, UserProgram
from sandmould.runs.measures import Measure, MeasureGroup
from sandmould.scenario.own_deck import OwnDeck


class DeckProgram(UserProgram[OwnDeck]):
    """See ``UserProgram``."""

    shipped = DECKS
    copied = own_deck.OUTPUT

    def files(self, scenario: OwnDeck) -> Mapping[str, Path]:
        """Template and files by key."""
        keys = ["template", *(f"files.{i}" for i in range(len(scenario.files)))]
        names = (scenario.template, *scenario.files)
        return {key: scenario.paths[name] for key, name in zip(keys, names, strict=True)}

    def foreign(self, scenario: OwnDeck) -> str:
        """What of a deck is not shipped: a file, or text that would stand among its commands."""
        for path in scenario.paths.values():
            if not path.resolve().is_relative_to(DECKS.resolve()):
                return f"{path.name} is not shipped"
        for name, value in scenario.values.items():
            if not _is_numbers(value):
                return f"values.{name} gives {Path(scenario.template).name} text, not numbers"
        return ""

    def to_read(self, scenarios: Sequence[OwnDeck]) -> list[str]:
        """Lines of the decks to look at."""
        from sandmould.kinds.deck.own import scan

        return scan.to_read(scenarios)


def _is_numbers(value: Any) -> bool:
    if isinstance(value, list):
        return all(map(_is_numbers, value))
    return value is None or isinstance(value, int | float)


class DeckPlanning(Planning[OwnDeck]):
    """See ``Planning``; only the deck knows what time it simulates."""

    slower = 3.0
    guess = "by expected_core_s (600 s unless you write it), until a first run has shown it"
    speed = DeckSpeed()
    program = DeckProgram()
    measures = (
        MeasureGroup(
            "as scenario.measures names them",
            lambda scenario: scenario.measures,
            (Measure("<measure>", "What scenario.measures takes of the log or of a dump."),),
        ),
    )
    measuring = ("sandmould/kinds/deck/own/measures.py",)

    def measured_by(self, scenario: OwnDeck) -> str:
        """With the measures that are asked for: all of the log and its dumps are kept."""
        asked = scenario.model_dump_json(include={"measures"})
        return digest(super().measured_by(scenario), asked)[:SHORT]

    def unmeasurable(self, scenario: OwnDeck, folder: Path) -> list[str]:
        """Measures whose columns stand neither in the log of a run nor in its dumps."""
        from sandmould.kinds.deck.own import measures

        return measures.unmeasurable(scenario, folder)

    def resolved(self, scenario: OwnDeck) -> OwnDeck:
        """With the hashes of its files; that of its deck comes with the seed."""
        return own_deck.with_file_hashes(scenario)

    def seeded(self, scenario: OwnDeck, seed: int) -> OwnDeck:
        """With the seed and the hash of the deck that is rendered with it."""
        return own_deck.with_deck_hash(super().seeded(scenario, seed))

    def takes_seed(self, scenario: OwnDeck) -> bool:
        """Whether the template asks for it."""
        return "seed" in own_deck.names_used(scenario)

    def problems(self, scenario: OwnDeck) -> list[Problem]:
        """What keeps the template from being rendered."""
        return own_deck.problems(scenario)

    def engine_problem(self, scenario: OwnDeck) -> Problem | None:
        """Say how the engine is installed where it is missing."""
        valid = engine_module(scenario.engine.name).installation_problem()
        return None if valid is None else Problem("engine.name", scenario.engine.name, valid)

    def sources(self, scenario: OwnDeck) -> list[Path]:
        """Template and files."""
        return list(scenario.paths.values())

    def template_hash(self, scenario: OwnDeck) -> str:
        """Hash of the rendered deck and of the files that it reads, as planned."""
        return digest(*sorted(scenario.sha256.values()))[:SHORT]

    def threads(self, scenario: OwnDeck) -> int:
        """One a rank."""
        return scenario.engine.ranks

    def ranks(self, scenario: OwnDeck) -> int:
        """MPI ranks."""
        return scenario.engine.ranks

    def memory_mb(self, scenario: OwnDeck) -> int:
        """As the user states it."""
        return scenario.memory_mb

    def planned_work(self, scenario: OwnDeck) -> float:
        """Processor time that the user expects."""
        return scenario.expected_core_s

    def predicted_s(self, scenario: OwnDeck) -> float:
        """Expected processor time, shared by the ranks."""
        return scenario.expected_core_s / scenario.engine.ranks

    def speed_class(self, scenario: OwnDeck) -> SpeedClass:
        """By engine."""
        return scenario.engine.name, 0

    def plan_cells(self, scenario: OwnDeck) -> Mapping[str, str]:
        """Its template, and its steps where the user states them."""
        steps = f"{scenario.steps:,}" if scenario.steps else "unknown"
        return {"template": Path(scenario.template).name, "steps": steps}
