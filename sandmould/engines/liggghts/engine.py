"""The LIGGGHTS engine as the rest of the house sees it."""

from __future__ import annotations

from pathlib import Path

from sandmould.engines.bed_deck import sources_of_step
from sandmould.engines.deck import Deck
from sandmould.engines.liggghts import OLDEST_VERSION
from sandmould.engines.liggghts.process import Conversation, LiggghtsDied, executable, version_of
from sandmould.engines.liggghts.render import refuse as refuse
from sandmould.engines.liggghts.render import render_deck as render_deck
from sandmould.engines.liggghts.render import write_deck as write_deck
from sandmould.engines.liggghts.session import LiggghtsSession
from sandmould.engines.program import Program
from sandmould.engines.session import Capabilities, EngineStop, Ranks, SandSession, engine_stop
from sandmould.runs.outcome import Outcome
from sandmould.scenario.scenario import Scenario

GRAIN_STEPS_PER_S = 3e6
RANKS = Ranks.ONE
RUNS_ITS_DECK = True
CAPABILITIES = Capabilities(
    bends_meshes=(2,),
    bends_in_frames=("box",),
    checkpoints_at_setups=True,
)


def installed_version() -> int | str:
    """Version of the LIGGGHTS executable, 0 where there is none."""
    path = executable()
    return (version_of(path) or 0) if path else 0


def installation_problem() -> str | None:
    """Say what would be a valid installation where LIGGGHTS is missing or too old."""
    version = installed_version()
    if version == 0:
        return "an installed LIGGGHTS: apt install liggghts"
    if _numbers(str(version)) < _numbers(OLDEST_VERSION):
        return f"LIGGGHTS {OLDEST_VERSION} or newer, found {version}"
    return None


def _numbers(version: str) -> list[int]:
    return [int(part) for part in version.split(".")]


def communicator() -> None:
    """There is none: LIGGGHTS runs in one process."""


def session_sources(scenario: Scenario) -> list[list[Path]]:
    """The session and the files that pass between it and the engine."""
    names = ("session.py", "process.py", "mesh_files.py")
    session = [Path(__file__).with_name(name) for name in names]
    return [session, *sources_of_step(scenario)]


def load_session(scenario: Scenario) -> None:
    """Import nothing more: LIGGGHTS is a program of its own."""


def open_session(
    program: Program, folder: Path, log: Path, checkpoint: Path | None = None
) -> SandSession:
    """Open a session on a rendered deck.

    Raises
    ------
    EngineStop
        When LIGGGHTS is missing or fails.
    RefusedError
        When LIGGGHTS lacks what the scenario asks for.
    """
    return LiggghtsSession(program, Deck.read(folder / "deck.in"), folder, log, checkpoint)


def read_deck(folder: Path, deck: str, log: Path) -> None:
    """Have LIGGGHTS read a deck in a process of its own; see ``DeckReaderModule``."""
    path = executable()
    if path is None:
        raise EngineStop(Outcome.ENGINE_MISSING, "LIGGGHTS cannot be started: apt install liggghts")
    conversation = Conversation(path, folder, log)
    try:
        conversation.say(f"include {deck}")
    except LiggghtsDied as error:
        raise engine_stop("LIGGGHTS", str(error), of_user=True) from error
    finally:
        conversation.close()
