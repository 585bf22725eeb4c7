"""How a deck of the user's own is planned."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

from sandmould import SHIPPED
from sandmould.bad_input import Problem
from sandmould.digest import SHORT, digest
from sandmould.engines.registry import engine_module
from sandmould.kinds.deck import speed
from sandmould.kinds.deck.measures import MEASURES
from sandmould.kinds.deck.own import deck as own_deck
from sandmould.kinds.kind import CORE_SECONDS, MachineSpeed, Planning, SpeedClass, UserProgram
from sandmould.scenario.own_deck import OwnDeck

DECKS = SHIPPED / "config" / "decks"
"""Decks that come with us."""
_ALLOWED = 3.0
"""Wall time to ask for over what the user expects."""


def vibration_s(scenario: OwnDeck) -> float:
    """Measures are those of the last row of the log."""
    return 0.0


def engine_problem(scenario: OwnDeck) -> Problem | None:
    """Say how the engine is installed where it is missing."""
    valid = engine_module(scenario.engine.name).installation_problem()
    return None if valid is None else Problem("engine.name", scenario.engine.name, valid)


def sources(scenario: OwnDeck) -> list[Path]:
    """Template and files."""
    return list(scenario.paths.values())


def template_hash(scenario: OwnDeck) -> str:
    """Hash of template and files as they are now."""
    now = own_deck.with_hashes(scenario.model_copy(update={"sha256": {}})).sha256
    return digest(*sorted(now.values()))[:SHORT]


def computed_hash(scenario: OwnDeck) -> str:
    """Hash of the rendered deck and of the files that it reads."""
    return digest(own_deck.render(scenario, "run", "study"), template_hash(scenario))


def threads(scenario: OwnDeck) -> int:
    """One a rank."""
    return scenario.engine.ranks


def ranks(scenario: OwnDeck) -> int:
    """MPI ranks."""
    return scenario.engine.ranks


def memory_mb(scenario: OwnDeck) -> int:
    """As the user states it."""
    return scenario.memory_mb


def allowed_s(scenario: OwnDeck) -> float:
    """Several times what the user expects."""
    return _ALLOWED * predicted_s(scenario)


def planned_work(scenario: OwnDeck) -> float:
    """Processor time that the user expects."""
    return scenario.expected_core_s


def predicted_s(scenario: OwnDeck) -> float:
    """Expected processor time, shared by the ranks."""
    return scenario.expected_core_s / scenario.engine.ranks


def planned_s(scenario: OwnDeck) -> float:
    """Only the deck knows: 0 stands for that."""
    return 0.0


def speed_class(scenario: OwnDeck) -> SpeedClass:
    """By engine."""
    return scenario.engine.name, 0


def plan_cells(scenario: OwnDeck) -> Mapping[str, str]:
    """Its template, and its steps where the user states them."""
    steps = f"{scenario.steps:,}" if scenario.steps else "unknown"
    return {"template": Path(scenario.template).name, "steps": steps}


def files(scenario: OwnDeck) -> Mapping[str, Path]:
    """Template and files by key."""
    keys = ["template", *(f"files.{i}" for i in range(len(scenario.files)))]
    names = (scenario.template, *scenario.files)
    return {key: scenario.paths[name] for key, name in zip(keys, names, strict=True)}


def foreign(scenario: OwnDeck) -> str:
    """Say what of a deck is not shipped: a file, or text that would stand among its commands."""
    for path in scenario.paths.values():
        if not path.resolve().is_relative_to(DECKS.resolve()):
            return f"{path.name} is not shipped"
    for name, value in scenario.values.items():
        if not _is_numbers(value):
            return f"values.{name} gives {Path(scenario.template).name} text, not numbers"
    return ""


def _is_numbers(value: Any) -> bool:
    if isinstance(value, list):
        return all(map(_is_numbers, value))
    return value is None or isinstance(value, int | float)


def to_read(scenarios: Sequence[OwnDeck]) -> list[str]:
    """Lines of the decks to look at."""
    from sandmould.kinds.deck.own import scan

    return scan.to_read(scenarios)


PLANNING = Planning[OwnDeck](
    work_unit=CORE_SECONDS,
    resolved=own_deck.with_hashes,
    problems=own_deck.problems,
    engine_problem=engine_problem,
    measures=MEASURES,
    vibration_s=vibration_s,
    sources=sources,
    template_hash=template_hash,
    computed_hash=computed_hash,
    threads=threads,
    ranks=ranks,
    memory_mb=memory_mb,
    allowed_s=allowed_s,
    planned_work=planned_work,
    predicted_s=predicted_s,
    planned_s=planned_s,
    speed_class=speed_class,
    plan_cells=plan_cells,
    guess="by expected_core_s, an estimate",
    speed=MachineSpeed(
        speed.stored_rate, speed.measured_rate, f"by a pilot run (results/{speed.STORED})"
    ),
    program=UserProgram[OwnDeck](shipped=DECKS, files=files, foreign=foreign, to_read=to_read),
    measuring=("sandmould/kinds/deck/execution.py",),
)
