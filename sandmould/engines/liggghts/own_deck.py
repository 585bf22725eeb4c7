"""Have LIGGGHTS read a deck of the user's own, in a process of its own."""

from __future__ import annotations

from pathlib import Path

from sandmould.engines.liggghts.process import Conversation, LiggghtsDied, executable
from sandmould.engines.session import EngineStop, engine_stop
from sandmould.runs.outcome import Outcome


def read_deck(folder: Path, deck: str, log: Path) -> None:
    """Have LIGGGHTS read a deck; see ``sandmould.engines.registry.DeckReaderModule``."""
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
