"""A box on a table that moves as rotating masses, its mounts and the grains make it.

The place x of the table is advanced by the same central differences as the grains, its damping
taken at the time of the forces:

    M (x+ - 2 x + x-)/dt^2 + C (x+ - x-)/(2 dt) + K x = push + s (F - F_0)

F is minus the sum of the contact forces on all grains: between grains they cancel, so it is what
the grains put on all surfaces. The place of the next step is thus known before the grains move on,
and the step loop takes it as it takes a motion that was laid down.
"""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np

from sandmould.compiled import njit
from sandmould.dem.barrier import wait_for_all
from sandmould.dem.grains import Floats
from sandmould.dem.solver import Solver
from sandmould.dem.steps import DONE, DemScene, Moving, Team, advance
from sandmould.dem.vectors import OPTIONS, dot, load


class MountedTable(NamedTuple):
    """What the motion of a table depends on, beside its drive."""

    mass_kg: float
    """M: all that moves with the table but the grains."""
    stiffness_n_m: float
    """K of the mounts."""
    share: float
    """s: how often the forces of the grains count."""
    rest_n: float
    """F_0: force of the resting grains on the surfaces along the direction of motion."""


class TableDrive(NamedTuple):
    """Drive of a table in some steps, each at the time of the places that a step begins from."""

    push_n: Floats
    """(steps,) float64, N: force of the rotating masses."""
    damping_kg_s: Floats
    """(steps,) float64: C of the mounts, with the brake."""


@njit(**OPTIONS)
def sand_force(dim: Any, force: Floats, direction: Any) -> float:
    """Force of the grains on all surfaces along a direction, N, from (n, d) contact forces."""
    total = 0.0
    for i in range(len(force)):
        total -= dot(load(dim, force, i), direction)
    return total


@njit(**OPTIONS)
def next_place(
    table: MountedTable,
    before: float,
    now: float,
    push: float,
    damping: float,
    sand: float,
    dt: float,
) -> float:
    """Place of the table one step on.

    Parameters
    ----------
    before, now : float, m
        Its places one step ago and now.
    push, sand : float, N
        Of the rotating masses and of the grains, now.
    damping : float, kg/s
    dt : float, s
    """
    b = 0.5 * damping * dt / table.mass_kg
    acting = push + table.share * (sand - table.rest_n) - table.stiffness_n_m * now
    speed = ((now - before) / dt * (1.0 - b) + dt / table.mass_kg * acting) / (1.0 + b)
    return now + dt * speed


@njit(**OPTIONS)
def _advance(
    dim: Any,
    steps: int,
    drifted: bool,
    scene: DemScene,
    moving: Moving,
    place: Floats,
    half_skin: float,
    thread: int,
    threads: int,
    team: Team,
    table: MountedTable,
    drive: TableDrive,
) -> tuple[int, int]:
    """See ``steps.advance``; before each step the table moves, of whose ``place`` two are given."""
    done, state = steps, DONE
    one = int(np.int64(1))  # for a literal numba would compile it once more
    for k in range(steps):
        if thread == 0 and not drifted:
            sand = sand_force(dim, moving.grains.force, scene.direction)
            place[k + 2] = next_place(
                table, place[k], place[k + 1], drive.push_n[k], drive.damping_kg_s[k], sand,
                scene.dt,
            )  # fmt: skip
        wait_for_all(team.barrier, threads)
        _, state = advance(
            dim, one, drifted, scene, moving, place[k:], half_skin, thread, threads, team
        )
        if state != DONE:
            done = k
            break
        drifted = False
        wait_for_all(team.barrier, threads)
    return done, state


class TableSolver(Solver):
    """A solver whose box may stand on a table that the grains push."""

    _table: tuple[MountedTable, TableDrive] | None = None
    """While the table moves."""
    table_places_m: Floats = np.zeros(2)
    """(2,) float64, m: of the table one step ago and now, along its direction; 0 where it stands
    with the resting grains on it."""

    def advance_on_table(self, table: MountedTable, drive: TableDrive) -> Floats:
        """Compute steps in which the table moves freely.

        ``drive``: its length is the number of steps.

        Gives (steps + 2,) float64, m; places of the table, from one step before the first to one
        step beyond the last. Raises NotANumberError.
        """
        places = np.zeros(len(drive.push_n) + 2)
        places[:2] = self.table_places_m
        self._table = table, drive
        try:
            self.advance(places)
        finally:
            self._table = None
        self.table_places_m = places[-2:].copy()
        return places

    def next_table_place_m(self, table: MountedTable, push_n: float, damping_kg_s: float) -> float:
        """Where the table will be one step on, m."""
        before, now = self.table_places_m
        sand = sand_force(self._dim, self.grains.force, self.scene.direction)
        place: float = next_place(table, before, now, push_n, damping_kg_s, sand, self.scene.dt)
        return place

    def _run(self, steps: int, drifted: bool, displacement_m: Floats) -> tuple[int, int]:
        if self._table is None:
            return super()._run(steps, drifted, displacement_m)
        table, whole = self._table
        left = slice(len(whole.push_n) - steps, None)
        drive = TableDrive(whole.push_n[left], whole.damping_kg_s[left])
        return self._together(_advance, steps, drifted, displacement_m, table, drive)

    def state(self) -> dict[str, np.ndarray]:
        """Everything that a continued run needs to go on bit for bit."""
        return super().state() | {"table_places_m": self.table_places_m}

    def restore(self, arrays: dict[str, np.ndarray]) -> None:
        """Go on from what ``state`` gave, with no loads collected yet."""
        super().restore(arrays)
        # The fill that runs share may be older than tables; it is filled while the table stands.
        self.table_places_m = arrays.get("table_places_m", np.zeros(2))
