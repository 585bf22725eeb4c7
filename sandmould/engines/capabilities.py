"""What an engine's sessions can do, known before one is opened, and what its ranks are."""

from __future__ import annotations

from dataclasses import dataclass
from enum import Enum
from typing import Literal


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
