"""The reference solver with a surface that is moved in every step."""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np

from sandmould.compiled import njit
from sandmould.dem.addresses import call_with_two
from sandmould.dem.barrier import wait_for_all
from sandmould.dem.grains import Floats, Ints
from sandmould.dem.steps import DONE, DemScene, Moving, Team, Walls, advance
from sandmould.dem.table import TableSolver
from sandmould.dem.vectors import OPTIONS
from sandmould.engines.session import StepMover


class _Mover(NamedTuple):
    """A ``StepMover`` as compiled code takes it."""

    addresses: Ints
    """(3,) int64: of its function and of its table; first of its vertices."""
    load: Floats
    velocity: Floats
    """See ``StepMover``."""
    sum: Floats
    """(nv, d) float64, N: of all loads of this record."""


@njit(**OPTIONS)
def _take_loads(walls: Walls, mover: _Mover) -> None:
    """Take what all chunks have put on the vertices, and clear it."""
    first = mover.addresses[2]
    load = mover.load
    for i in range(load.shape[0]):
        for k in range(load.shape[1]):
            load[i, k] = 0.0
            for c in range(len(walls.loads)):
                load[i, k] += walls.loads[c, first + i, k]
                walls.loads[c, first + i, k] = 0.0
            mover.sum[i, k] += load[i, k]


@njit(**OPTIONS)
def _set_motion(walls: Walls, mover: _Mover, step: int) -> None:
    """Ask how the vertices move in a step, and let them."""
    call_with_two(mover.addresses[0], mover.addresses[1], step)
    first = mover.addresses[2]
    for i in range(mover.velocity.shape[0]):
        walls.arrays.steps_left[first + i] = 1
        for k in range(mover.velocity.shape[1]):
            walls.arrays.vertex_velocity[first + i, k] = mover.velocity[i, k]


@njit(**OPTIONS)
def _advance(
    dim: Any,
    steps: int,
    drifted: bool,
    scene: DemScene,
    moving: Moving,
    displacement: Floats,
    half_skin: float,
    thread: int,
    threads: int,
    team: Team,
    mover: _Mover,
    first_step: int,
) -> tuple[int, int]:
    """See ``steps.advance``, which computes every step; the mover comes before each."""
    walls = moving.walls
    done, state = steps, DONE
    one = int(np.int64(1))  # for a literal numba would compile it once more
    for k in range(steps):
        if thread == 0 and not drifted:
            _set_motion(walls, mover, first_step + k)
        wait_for_all(team.barrier, threads)
        _, state = advance(
            dim, one, drifted, scene, moving, displacement[k:], half_skin, thread, threads, team
        )
        if state != DONE:
            done = k
            break
        drifted = False
        wait_for_all(team.barrier, threads)
        if thread == 0:
            _take_loads(walls, mover)
    return done, state


class MovedSolver(TableSolver):
    """A solver one of whose surfaces may be moved in every step."""

    _mover: _Mover | None = None

    def attach_mover(self, name: str, mover: StepMover) -> None:
        """Let a surface be moved in every step from the next one on."""
        first = self.surfaces.vertices_of(name).start
        self._mover = _Mover(
            np.array([mover.call, mover.table, first]),
            mover.load_n,
            mover.velocity_m_s,
            np.zeros_like(mover.load_n),
        )

    def _run(self, steps: int, drifted: bool, displacement_m: Floats) -> tuple[int, int]:
        mover = self._mover
        if mover is None:
            return super()._run(steps, drifted, displacement_m)
        loads = self.moving.walls.loads
        rows = slice(mover.addresses[2], mover.addresses[2] + len(mover.load))
        mover.sum[:] = loads[:, rows].sum(axis=0)
        loads[:, rows] = 0.0
        ended = self._together(_advance, steps, drifted, displacement_m, mover, self.steps)
        loads[0, rows] = mover.sum
        return ended
