"""What every engine can be asked; the driver and the coupling know nothing else of it."""

from __future__ import annotations

import re
from collections.abc import Mapping
from dataclasses import dataclass
from enum import Enum
from pathlib import Path
from typing import Any, Literal, Protocol, TypeVar

import numpy as np
from numpy.typing import NDArray

from sandmould.bad_input import Problem
from sandmould.engines.program import Stage
from sandmould.engines.snapshot import Snapshot
from sandmould.engines.table_periods import TablePeriod
from sandmould.runs.outcome import Outcome

Array = NDArray[np.float64]


@dataclass(frozen=True)
class Capabilities:
    """Abilities of the sessions of one engine; see ``sandmould.engines.session.Session``.

    A coupling asks for them and never for the engine's name.
    """

    bends_meshes: tuple[int, ...]
    """Dimensions of the scenes in which ``move_surface`` takes a mesh to new vertices."""
    bends_in_frames: tuple[Literal["box", "laboratory"], ...]
    """Frames of reference in which it does."""
    repeats_windows: bool = False
    """Whether a window can be computed again from its checkpoint: ``save_checkpoint`` and
    ``restore_checkpoint``."""
    calls_movers: bool = False
    """Whether ``attach_mover`` lets a surface be moved inside every step."""
    loads_of_every_step: bool = False
    """Whether ``vertex_loads`` are means over all steps, not over samples some steps apart, so
    that a window may be as short as one step."""
    checkpoints_at_setups: bool = False
    """Whether a checkpoint forces a setup of the engine, so that it has to come with one."""
    moves_tables: bool = False
    """Whether the box can stand on a table that rotating masses, mounts and the sand move."""
    moves_walls: bool = False
    """Whether a gate opens in a stated time, and a wall of the box moves as a piston."""
    changes_checks: bool = False
    """Whether a session goes on from a checkpoint with checks at another interval."""


class Ranks(Enum):
    """How an engine shares the work of one run."""

    PROCESSES = "MPI ranks, each a process"
    THREADS = "threads of one process"
    ONE = "one process without threads"


@dataclass(frozen=True)
class StepMover:
    """A compiled function that an engine calls before every step, and what both exchange.

    The engine writes the loads, calls, and moves the vertices with the velocities through one
    step. What lies behind the function is known to its owner alone.
    """

    call: int
    """Address of a compiled function of two integers, ``table`` and the step's number."""
    table: int
    """Address that it is given."""
    load_n: Array
    """(nv, d) float64, N: of the grains on the vertices, at the last step."""
    velocity_m_s: Array
    """(nv, d) float64, m/s: of the vertices until the next step, in the frame of the box."""


Shared = TypeVar("Shared")


class EngineStop(Exception):  # noqa: N818 - it is an outcome, not always an error
    """The engine cannot go on; carries the outcome that fits and what the engine said."""

    def __init__(self, outcome: Outcome, detail: str) -> None:
        self.outcome = outcome
        self.detail = detail
        super().__init__(f"{outcome.label}: {detail}")


_LOST = re.compile(r"Lost atoms|Did not assign all atoms|out of range atoms")
_LACKS = re.compile(r"(Unrecognized|Invalid|Unknown) (\w+ ){0,2}style|not enabled in this LAMMPS")


def engine_stop(engine: str, message: str, of_user: bool = False) -> EngineStop:
    """Outcome that fits an error message of LAMMPS or LIGGGHTS, which is quoted.

    ``of_user``: whether the deck is the user's own, in which a style can be misspelt.
    """
    text = " ".join(message.split())
    if _LOST.search(text):
        return EngineStop(Outcome.LOST_GRAINS, f"{engine} says: {text}")
    if of_user and _LACKS.search(text) and "not enabled" not in text:
        unknown = "its name is misspelt, or this build lacks it"
        said = f"{engine} does not know a style of the deck: {unknown}; it says: {text}"
        return EngineStop(Outcome.BAD_INPUT, said)
    if _LACKS.search(text):
        lacks = f"this build of {engine} lacks a style that the deck needs; it says: {text}"
        return EngineStop(Outcome.ENGINE_MISSING, lacks)
    return EngineStop(Outcome.ENGINE_FAILED, f"{engine} says: {text}")


class RefusedError(Exception):
    """The engine lacks what was asked, and says so before it starts."""

    def __init__(self, key: str, value: Any, valid: str) -> None:
        self.problem = Problem(key, value, valid)
        super().__init__(str(self.problem))


class Session(Protocol):
    """One scenario being computed, as the driver sees it."""

    @property
    def version(self) -> str:
        """Version of the engine."""

    @property
    def grains(self) -> int:
        """Grains now in the box."""

    @property
    def step_s(self) -> float:
        """Time step."""

    @property
    def stage(self) -> Stage:
        """Stage that is being computed."""

    @property
    def stage_over(self) -> bool:
        """Whether the stage's time is up or the sand at rest."""

    @property
    def at_rest(self) -> bool:
        """Whether the sand has come to rest in a stage of settling."""

    @property
    def rest_sentence(self) -> str:
        """What the last check for rest found."""

    @property
    def steps(self) -> int:
        """Steps since the run began, resumed ones included."""

    @property
    def time_s(self) -> float:
        """Simulated time."""

    def insert_layer(self, number: int) -> None:
        """Drop a planned layer from over the bed."""

    def set_state(self, position_m: Array, velocity_m_s: Array, spin_rad_s: Array) -> None:
        """Place all grains now in the box exactly, without contact history.

        Meant for verification: a stage must be started after it. ``position_m``, ``velocity_m_s``,
        (n, d) float64, m and m/s: in the order of ids. ``spin_rad_s``: (n, 3) float64, rad/s.
        """

    def start_stage(self, stage: Stage) -> None:
        """Begin to settle or to vibrate."""

    def advance(self, duration_s: float | None = None) -> None:
        """Compute for a duration, or up to the next check, not past the end of the stage.

        ``duration_s``: rounded up to whole steps.

        Raises
        ------
        EngineStop
            When grains are lost or the engine fails.
        """

    def end_stage(self) -> None:
        """Close the stage that is over."""

    def snapshot(self) -> Snapshot:
        """State of all grains, relative to the box."""

    def surface_loads(self) -> Mapping[str, Array] | None:
        """Give the mean force of the sand on each wall and block over the last check.

        (d,) float64, N, by surface; None when the last advance did not end a check.
        """

    def table_periods(self) -> list[TablePeriod]:
        """Give the periods of a vibration on mounts that have ended since the last asking."""

    def exact_limit_s(self) -> float:
        """Find the step up to which the contacts of this moment stay bounded.

        Dashpots are corrected for the limit itself; once the bed has given the step, for that.

        Limit of the whole system with its dashpots, eq. (42); infinite where nothing touches. All
        contacts count as sticking, and none opens: the stiffest case.
        """

    def write_checkpoint(self, folder: Path) -> None:
        """Write all that a continued run needs; only after a full check."""

    @property
    def can_checkpoint(self) -> bool:
        """Whether the last advance ended a check, so that no mean is cut."""

    def share(self, value: Shared) -> Shared:
        """Give the first rank's value to all ranks."""

    @property
    def is_root(self) -> bool:
        """Whether this process writes the files."""

    def close(self) -> None:
        """Free the engine."""


class SandSession(Session, Protocol):
    """The same of an engine alone, with what a coupling asks of its sand."""

    @property
    def sand_rests(self) -> bool:
        """Whether the checks of this stage find the sand at rest, held or not."""

    def hold_rest(self, why: str) -> None:
        """Let the stage go on while something else than the sand still moves.

        ``why``: what has moved since the last check.
        """

    def vertex_loads(self, name: str) -> Array | None:
        """Give the mean force of the sand on each vertex of a surface since the last asking.

        Of a check that ended without asking nothing is kept. Forces between vertices are shared
        out by shape functions, eq. (56), so that force and moment are those of the contacts.

        ``name``: a surface made of facets.

        (nv, d) float64, N; None when no load was sampled since. Raises RefusedError.
        """

    def move_surface(self, name: str, vertices_m: Array, window_s: float) -> None:
        """Move a surface to new vertices over the next window, or refuse. Raises RefusedError."""

    def save_checkpoint(self) -> Any:
        """Give all that is needed to compute on from here, in memory, or refuse.

        For another iteration of a window; ``write_checkpoint`` is for another process. Raises
        RefusedError.
        """

    def restore_checkpoint(self, checkpoint: Any) -> None:
        """Compute on from what ``save_checkpoint`` gave, which may be restored again."""

    def attach_mover(self, name: str, mover: StepMover) -> None:
        """Let a surface be moved in every step by the loads on it, or refuse.

        A session opened from a checkpoint is given it again. Raises RefusedError.
        """
