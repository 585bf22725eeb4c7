"""The engines by their names: what each offers, what it refuses, its deck, its session."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from importlib.metadata import version
from itertools import chain
from pathlib import Path
from typing import Any, Protocol, assert_never

from sandmould import ROOT, geometry
from sandmould.bad_input import Problem
from sandmould.digest import code_identity, digest
from sandmould.engines.deck import Deck, dialect_hash, template_files
from sandmould.engines.program import Program, build_program
from sandmould.engines.session import Capabilities, Ranks, RefusedError, SandSession
from sandmould.scenario.checks.moving import moving_wall, unbalance_key
from sandmould.scenario.engine import ENGINE_NAMES, DeckReader, EngineName
from sandmould.scenario.pattern import PatternDrawing
from sandmould.scenario.scenario import Scenario
from sandmould.scenario.solids import SolidMesh

_OF_EVERY_ENGINE = (
    "scenario/contact.py", "scenario/placement.py", "engines/program.py",
    "engines/staged_session.py", "engines/deck_session.py", "engines/driver.py",
    "engines/guard.py", "engines/bed_step.py",
)  # fmt: skip
"""How hard sand is, where grains begin, how stages follow each other and end, what stops a run."""


class EngineModule(Protocol):
    """What ``sandmould.engines.<name>.engine`` offers, for each engine."""

    CAPABILITIES: Capabilities
    GRAIN_STEPS_PER_S: float
    """Speed of one core in 2D that batches are filled by (docs/developers/speed.md); fixed, so
    that a study
    has the same batches on every machine."""
    RANKS: Ranks
    RUNS_ITS_DECK: bool
    """Whether what a deck commands is what is computed; else it only lists the numbers."""

    def installed_version(self) -> int | str:
        """Version of the engine on this machine, 0 where there is none."""

    def installation_problem(self) -> str | None:
        """Say what would be a valid installation where the engine is missing or too old."""

    def communicator(self) -> Any:
        """Give the MPI communicator of this process, or None where the engine has one process.

        Raises
        ------
        EngineStop
            When the engine cannot be loaded.
        """

    def refuse(self, scenario: Scenario) -> None:
        """Raise RefusedError for what the engine lacks."""

    def render_deck(
        self, program: Program, sources: Mapping[str, str], run: str, study: str
    ) -> Deck:
        """Render the deck."""

    def write_deck(
        self, program: Program, sources: Mapping[str, str], folder: Path, run: str, study: str
    ) -> None:
        """Write ``deck.in`` and ``layers/``; the deck last."""

    def session_sources(self, scenario: Scenario) -> list[list[Path]]:
        """Files of ours that compute beside what the deck commands: its session, our kernels.

        Files that are used together make one group.
        """

    def load_session(self, scenario: Scenario) -> None:
        """Import what a session needs and no plan does.

        What starts threads, MPI or the engine is left to the run's own process.
        """

    def open_session(
        self, program: Program, folder: Path, log: Path, checkpoint: Path | None = None
    ) -> SandSession:
        """Open a session on a rendered deck, afresh or from a checkpoint."""


class DeckReaderModule(Protocol):
    """What the module of an engine offers besides, where it reads decks of users."""

    def read_deck(self, folder: Path, deck: str, log: Path) -> None:
        """Have the engine read a deck from its first line to its last; every rank calls this.

        Raises
        ------
        EngineStop
            When the engine cannot be started, or stops with an error, which is quoted.
        """


def engine_of(scenario: Scenario) -> EngineModule:
    """Import the module of a scenario's engine, and only that one."""
    return engine_module(scenario.engine.name)


def engine_module(name: EngineName) -> EngineModule:
    """Import the module of an engine by its name, and only that one.

    The type checker compares each module with what is asked of it.
    """
    match name:
        case "lammps":
            from sandmould.engines.lammps import engine as lammps

            return lammps
        case "liggghts":
            from sandmould.engines.liggghts import engine as liggghts

            return liggghts
        case "reference":
            from sandmould.engines.reference import engine as reference

            return reference
        case _:
            assert_never(name)


def engines_that(can: Callable[[Capabilities], bool]) -> list[str]:
    """Names of the engines whose sessions can do something, in the order of the registry."""
    return [name for name in ENGINE_NAMES if can(engine_module(name).CAPABILITIES)]


def deck_reader(name: DeckReader) -> DeckReaderModule:
    """Import how an engine reads decks of users, by its name."""
    match name:
        case "lammps":
            from sandmould.engines.lammps import engine as lammps

            return lammps
        case "liggghts":
            from sandmould.engines.liggghts import engine as liggghts

            return liggghts
        case _:
            assert_never(name)


def mpi_ranks(scenario: Scenario) -> int:
    """Processes that a run is started with: 1 where ranks are threads of one process."""
    return scenario.engine.ranks if engine_of(scenario).RANKS is Ranks.PROCESSES else 1


def calls_our_kernels(scenario: Scenario) -> bool:
    """Whether compiled code of the house takes part, as the engine or beside it."""
    sources = chain(*engine_of(scenario).session_sources(scenario))
    return any(path.is_relative_to(ROOT / "sandmould" / "dem") for path in sources)


def communicator_of(scenario: Scenario) -> Any:
    """The MPI communicator of the processes that compute a run; None where there is one."""
    return None if mpi_ranks(scenario) == 1 else engine_of(scenario).communicator()


def deck_hash(scenario: Scenario) -> str:
    """Hash of all that turns a scenario into commands, and of our code that computes beside it."""
    runs_its_deck = engine_of(scenario).RUNS_ITS_DECK
    return _code_hash(scenario) + (dialect_hash(scenario.engine.name) if runs_its_deck else "")


def deck_sources(scenario: Scenario) -> list[Path]:
    """Files of the repository that ``deck_hash`` is made from."""
    engine = scenario.engine.name
    templates = template_files(engine) if engine_of(scenario).RUNS_ITS_DECK else []
    return sorted({*templates, *chain(*code_groups(scenario))})


def computed_hash(scenario: Scenario) -> str:
    """Hash of what the engine is told to compute, and of our code that computes beside it.

    Other templates, comments or keys that leave a deck's commands alone do not change it.
    """
    deck = engine_of(scenario).render_deck(build_program(scenario), {}, "run", "study")
    return digest(deck.commands, _code_hash(scenario))


def _code_hash(scenario: Scenario) -> str:
    return code_identity(code_groups(scenario), version("numba"))


def code_groups(scenario: Scenario) -> list[list[Path]]:
    """Files that decide what is computed on any engine, and those of the scenario's engine."""
    of_every_engine = [ROOT / "sandmould" / name for name in _OF_EVERY_ENGINE]
    pattern = [body.shape for body in scenario.pattern.bodies] if scenario.pattern else []
    drawn = any(
        isinstance(solid, SolidMesh | PatternDrawing)
        for solid in (*scenario.obstacles, *scenario.cavities, *pattern)
    )
    surfaces = [geometry.source_files()] if drawn else []
    return [of_every_engine, *surfaces, *engine_of(scenario).session_sources(scenario)]


def engine_problem(scenario: Scenario) -> Problem | None:
    """Say why the scenario's engine cannot compute it, before anything starts."""
    engine = engine_of(scenario)
    valid = engine.installation_problem()
    if valid is not None:
        return Problem("engine.name", scenario.engine.name, valid)
    if not engine.CAPABILITIES.moves_tables and (key := unbalance_key(scenario)):
        able = " or ".join(engines_that(lambda can: can.moves_tables))
        valid = (
            f"acceleration, velocity or displacement on engine {scenario.engine.name}; a table on "
            f"mounts moves on engine {able} alone, whose runs say with what amplitude"
        )
        return Problem(f"{key}.hold", "unbalance", valid)
    if not engine.CAPABILITIES.moves_walls and (moved := moving_wall(scenario)):
        able = " or ".join(engines_that(lambda can: can.moves_walls))
        valid = f"absent on engine {scenario.engine.name}, whose walls stand; engine {able} has it"
        return Problem(*moved, valid)
    shaken_s = scenario.rest.shaken_check_every_s
    if shaken_s is not None and not engine.CAPABILITIES.changes_checks:
        able = " or ".join(engines_that(lambda can: can.changes_checks))
        valid = f"absent on engine {scenario.engine.name}, whose deck has one interval of checks"
        return Problem("rest.shaken_check_every_s", shaken_s, f"{valid}; engine {able} has it")
    try:
        engine.refuse(scenario)
    except RefusedError as refusal:
        return refusal.problem
    return None
