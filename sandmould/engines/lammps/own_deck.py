"""Have LAMMPS read a deck of the user's own, in this process."""

from __future__ import annotations

import contextlib
import os
from collections.abc import Iterator
from pathlib import Path
from typing import Any

from sandmould.engines.lammps.session import load_library
from sandmould.engines.session import engine_stop


def read_deck(folder: Path, deck: str, log: Path) -> None:
    """Have LAMMPS read a deck; see ``sandmould.engines.registry.DeckReaderModule``."""
    lammps, _ = load_library()
    arguments = ["-log", str(log.absolute()), "-screen", "none", "-nocite"]
    with _working_in(folder):
        lmp: Any = lammps(cmdargs=arguments)
        try:
            lmp.file(deck)
        except Exception as error:  # the library raises plain Exception
            raise engine_stop("LAMMPS", str(error), of_user=True) from error
        finally:
            lmp.close()


@contextlib.contextmanager
def _working_in(folder: Path) -> Iterator[None]:
    before = Path.cwd()
    os.chdir(folder)
    try:
        yield
    finally:
        os.chdir(before)
