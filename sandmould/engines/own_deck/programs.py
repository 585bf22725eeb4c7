"""Have a deck read by its engine, from its first line to its last."""

from __future__ import annotations

import contextlib
import os
from collections.abc import Iterator
from pathlib import Path
from typing import Any

from sandmould.engines.lammps.session import load_library
from sandmould.engines.liggghts.process import Conversation, LiggghtsDied, executable
from sandmould.engines.session import EngineStop, engine_stop
from sandmould.runs.outcome import Outcome


def run_on_lammps(folder: Path, deck: str, log: Path) -> None:
    """Have LAMMPS read a deck in this process; every rank calls this.

    Parameters
    ----------
    folder : Path
        Working folder of the deck.
    deck : str
        Its name in there.
    log : Path
        LAMMPS's log.

    Raises
    ------
    EngineStop
        When LAMMPS cannot be loaded, or stops with an error, which is quoted.
    """
    lammps, _ = load_library()
    arguments = ["-log", str(log.absolute()), "-screen", "none", "-nocite"]
    with _working_in(folder):
        lmp: Any = lammps(cmdargs=arguments)
        try:
            lmp.file(deck)
        except Exception as error:  # the library raises plain Exception
            raise engine_stop("LAMMPS", str(error)) from error
        finally:
            lmp.close()


def run_on_liggghts(folder: Path, deck: str, log: Path) -> None:
    """Have LIGGGHTS read a deck in a process of its own; see ``run_on_lammps``."""
    path = executable()
    if path is None:
        raise EngineStop(Outcome.ENGINE_MISSING, "LIGGGHTS cannot be started: apt install liggghts")
    conversation = Conversation(path, folder, log)
    try:
        conversation.say(f"include {deck}")
    except LiggghtsDied as error:
        raise engine_stop("LIGGGHTS", str(error)) from error
    finally:
        conversation.close()


RUN_ON = {"lammps": run_on_lammps, "liggghts": run_on_liggghts}


@contextlib.contextmanager
def _working_in(folder: Path) -> Iterator[None]:
    before = Path.cwd()
    os.chdir(folder)
    try:
        yield
    finally:
        os.chdir(before)
