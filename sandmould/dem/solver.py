"""The reference solver: grains, surfaces and their laws, advanced in time."""

from __future__ import annotations

import math
import os
from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor
from typing import Any

import numpy as np

from sandmould.dem.barrier import new_barrier
from sandmould.dem.broad_phase import Candidates, FacetGrids, candidates_in
from sandmould.dem.grains import Floats, Grains
from sandmould.dem.lanes import lanes_of_processor
from sandmould.dem.motion import kick
from sandmould.dem.moving_state import chunk_bounds, from_arrays, pair_up, to_arrays
from sandmould.dem.near_pairs import Contacts, contacts_of, move_contacts, near_gap, new_near_pairs
from sandmould.dem.neighbours import Pairs, extent_of, list_pairs, make_grid, sort_into_cells
from sandmould.dem.steps import (
    LIST_IS_OLD,
    NO_ROOM,
    NOT_A_NUMBER,
    DemScene,
    Moving,
    Team,
    advance,
    exchanged,
    find_forces,
    new_walls,
    shares,
)
from sandmould.dem.surfaces import Surfaces
from sandmould.dem.vectors import dim_of
from sandmould.dem.wall_history import carry_history as carry_wall_history
from sandmould.dem.wall_history import new_history


class NotANumberError(ArithmeticError):
    """A velocity grew beyond all bounds."""


class Solver:
    """Grains among surfaces under section 3 of the paper.

    The state between two calls of ``advance`` is that of the central differences: positions and
    contact forces at a step, velocities and spins half a step before it.
    """

    def __init__(
        self,
        scene: DemScene,
        surfaces: Surfaces,
        skin_m: float,
        threads: int = 1,
        orientations: bool = False,
        lanes: tuple[float, ...] | None = None,
    ) -> None:
        """Set up a scene without grains.

        Parameters
        ----------
        skin_m : float
            Pairs nearer than this are listed; the list serves until a grain has gone half of it.
        threads : int
            No more are started than there are cores; results do not depend on it.
        orientations : bool
            Whether ``orientation`` is kept: angles (n, 1) in 2D, matrices (n, 9) in 3D.
        lanes : tuple of floats, optional
            As many zeros as grains are computed at once, a power of two: those of the processor
            where none are given. Results do not depend on it.
        """
        self.scene = scene
        self.surfaces = surfaces
        self.dimension = surfaces.dimension
        self.steps = 0
        """Steps done."""
        self.lists = 0
        """How often pairs were listed."""
        self._dim = dim_of(self.dimension)
        self._lanes = lanes or lanes_of_processor()
        self._skin = skin_m
        self._threads = min(threads, len(os.sched_getaffinity(0)))
        self._pool = ThreadPoolExecutor(max(1, self._threads - 1))
        self._orientations = orientations
        self._facets = FacetGrids()
        self._nothing = self._empty()
        self.moving = self._nothing
        """All that the step loop moves; replaced whenever pairs are listed."""

    def _empty(self) -> Moving:
        d = self.dimension
        grains, pairs = Grains.none(d), Pairs.none()
        none = np.zeros(0, dtype=np.uint32)
        candidates = Candidates(none, np.zeros(1, dtype=np.uint32), none.copy())
        bound = chunk_bounds(0)
        history = new_history(self._dim, 0)
        near = new_near_pairs(
            self._dim, len(self._lanes), bound, grains, pairs, Contacts.none(d), 0.0
        )
        walls = new_walls(self.surfaces.arrays, bound, candidates, history)
        coefficients = pair_up(grains, self.scene.grain_law)
        upright, listed = self._upright(0), np.zeros((0, d))
        return Moving(
            grains,
            listed.copy(),
            coefficients,
            pairs,
            near,
            self._lanes,
            bound,
            walls,
            upright,
            listed,
            np.zeros(1),
        )

    def _upright(self, n: int) -> Floats:
        """Orientations of grains not turned yet."""
        if not self._orientations:
            return np.zeros((0, 1 if self.dimension == 2 else 9))
        return np.tile(np.zeros(1) if self.dimension == 2 else np.eye(3).ravel(), (n, 1))

    @property
    def grains(self) -> Grains:
        """All grains, in the order they are stored in."""
        return self.moving.grains

    @property
    def contacts(self) -> Contacts:
        """Touching pairs of grains and their history, a copy."""
        moving = self.moving
        return contacts_of(self._dim, moving.bound, moving.grains, moving.near)

    @property
    def orientation(self) -> Floats:
        """Orientations of the grains, eqs. (8) and (12)."""
        return self.moving.orientation

    def add(self, grains: Grains) -> None:
        """Add grains that touch nothing; their velocities belong to the time of their positions."""
        n = len(grains.id)
        scene = self.scene
        kick(self._dim, 0, n, grains, scene.gravity, scene.damping, -0.5 * scene.dt)
        moving = self.moving
        self.moving = moving._replace(
            grains=moving.grains.joined(grains),
            orientation=np.concatenate([moving.orientation, self._upright(n)]),
        )
        self._list(np.zeros(self.dimension))

    def place(self, position_m: Floats, velocity_m_s: Floats, spin_rad_s: Floats) -> None:
        """Put all grains where and how they are given, in the order of ids, without history.

        Contacts that the places imply are felt from the first step on.
        """
        order = np.argsort(self.grains.id)
        same = self.grains.ordered(order)._replace(
            position=position_m.copy(),
            velocity=velocity_m_s.copy(),
            spin=spin_rad_s.copy(),
            force=np.zeros_like(position_m),
            moment=np.zeros_like(spin_rad_s),
        )
        self.moving = self._empty()._replace(grains=same, orientation=self._upright(len(order)))
        self._list(np.zeros(self.dimension))
        find_forces(self._dim, self.scene, self.moving)
        self.moving.walls.loads[:] = 0.0
        scene = self.scene
        kick(self._dim, 0, len(order), self.grains, scene.gravity, scene.damping, -0.5 * scene.dt)

    def change_step(self, earlier_s: float, steps: int) -> None:
        """Go on with the step of the scene from a state that was computed with another one.

        Velocities stood half of the other step before now, and now stand half of this one before
        it. The box must stand. ``steps``: those that count as done from now on.
        """
        scene, grains = self.scene, self.grains
        lag_s = 0.5 * (earlier_s - scene.dt)
        kick(self._dim, 0, len(grains.id), grains, scene.gravity, scene.damping, lag_s)
        self.steps = steps

    def remove_surface(self, name: str) -> None:
        """Take a surface away at once, as a gate that opens, while the box is where it began.

        Loads that were collected since the last asking are forgotten.
        """
        self.surfaces.remove(name)
        moving = self.moving
        walls = new_walls(
            self.surfaces.arrays,
            moving.bound,
            moving.walls.candidates,
            moving.walls.history,
        )
        self.moving = moving._replace(walls=walls)
        self._list(np.zeros(self.dimension))

    def _list(self, shift: Floats) -> None:
        """Sort the grains by place and list what is near what, history carried over."""
        old, nothing = self.moving, self._nothing
        n = len(old.grains.id)
        size = 2 * float(old.grains.radius_of.max()) + self._skin
        grid = make_grid(*extent_of(old.grains.position), size, n)
        order, start = sort_into_cells(old.grains.position, grid)
        contacts = self.contacts
        move_contacts(self._dim, contacts, order)
        ids = old.grains.id[old.walls.candidates.rows]
        grains = old.grains.ordered(order)
        orientation = old.orientation[order] if self._orientations else old.orientation
        # What is made anew is let go first: it is most of the memory.
        self.moving = old = old._replace(
            grains=grains,
            ahead=nothing.ahead,
            pairs=nothing.pairs,
            near=nothing.near,
            orientation=orientation,
            listed=nothing.listed,
        )
        pairs = list_pairs(grains, start, grid, self._skin)
        bound = chunk_bounds(n)
        speed2 = float(np.einsum("ij,ij->i", grains.velocity, grains.velocity).max())
        gap_m = near_gap(self._skin, self.scene.dt * math.sqrt(speed2))
        near = new_near_pairs(self._dim, len(self._lanes), bound, grains, pairs, contacts, gap_m)
        arrays = self.surfaces.arrays
        reach_m = self._skin + float(grains.radius_of.max())
        candidates = candidates_in(
            self._dim,
            grains.position,
            grains.radius,
            self._skin,
            arrays,
            tuple(shift.tolist()),
            *self._facets.of(self._dim, arrays, reach_m),
        )
        history = carry_wall_history(
            self._dim,
            ids,
            old.walls.history,
            grains.id[candidates.rows],
            candidates.start,
        )
        walls = new_walls(arrays, bound, candidates, history)
        walls.loads[0] = old.walls.loads.sum(axis=0)
        self.moving = Moving(
            grains,
            np.empty_like(grains.position),
            pair_up(grains, self.scene.grain_law),
            pairs,
            near,
            self._lanes,
            bound,
            walls,
            orientation,
            grains.position - shift,
            np.array([0.5 * self._skin]),
        )
        self.lists += 1

    def _make_room(self) -> None:
        """Choose the near pairs anew, with room for all of them."""
        moving, gap_m = self.moving, float(self.moving.near.gap[0])
        near = new_near_pairs(
            self._dim,
            len(self._lanes),
            moving.bound,
            moving.grains,
            moving.pairs,
            self.contacts,
            gap_m,
        )
        self.moving = moving._replace(near=near)

    def advance(self, displacement_m: Floats) -> None:
        """Compute as many steps as displacements are given, less two.

        ``displacement_m``, (steps + 2,) float64, m: of the box along its direction, from one step
        before now to one step beyond the last. Raises NotANumberError.
        """
        steps, done, drifted = len(displacement_m) - 2, 0, False
        while done < steps:
            more, state = self._run(steps - done, drifted, displacement_m[done:])
            done += more
            self.steps += more
            if state == NOT_A_NUMBER:
                raise NotANumberError(self.steps)
            drifted = state in (LIST_IS_OLD, NO_ROOM)
            if state == NO_ROOM:
                self._make_room()
            if state == LIST_IS_OLD:
                shift = 0.0 if self.scene.box_frame else displacement_m[done + 2]
                self._list(shift * np.array(self.scene.direction))

    def _run(self, steps: int, drifted: bool, displacement_m: Floats) -> tuple[int, int]:
        """Let all threads run the step loop together."""
        done, state = self._together(advance, steps, drifted, displacement_m)
        if min(done, steps - 1) % 2:
            grains, ahead = exchanged(self.grains, self.moving.ahead)
            self.moving = self.moving._replace(grains=grains, ahead=ahead)
        return done, state

    def _together(
        self, loop: Callable[..., Any], steps: int, drifted: bool, displacement_m: Floats, *own: Any
    ) -> tuple[int, int]:
        """Call a step loop in all threads: arguments and result as of ``advance``, then its own."""
        chunks = len(self.moving.bound) - 1
        threads = min(self._threads, chunks)
        team = Team(
            new_barrier(), np.zeros(chunks), np.zeros(1, dtype=np.int64),
            shares(self.moving.bound, self.moving.near, threads),
        )  # fmt: skip
        given = self._dim, steps, drifted, self.scene, self.moving, displacement_m, 0.5 * self._skin

        def run_thread(thread: int) -> tuple[int, int]:
            ended: tuple[int, int] = loop(*given, thread, threads, team, *own)
            return ended

        others = [self._pool.submit(run_thread, thread) for thread in range(1, threads)]
        ended = run_thread(0)
        for other in others:
            other.result()
        return ended

    def whole_step_velocities(self, acceleration_m_s2: float = 0.0) -> tuple[Floats, Floats]:
        """Velocities and spins at the time of the positions.

        ``acceleration_m_s2``: of the box along its direction now, zero in the laboratory frame.

        Returns
        -------
        velocity : (n, d) float64, m/s
        spin : (n, s) float64, rad/s
        """
        scene = self.scene
        copied = self.grains._replace(
            velocity=self.grains.velocity.copy(), spin=self.grains.spin.copy()
        )
        body = tuple(
            g - acceleration_m_s2 * e for g, e in zip(scene.gravity, scene.direction, strict=True)
        )
        kick(self._dim, 0, len(copied.id), copied, body, scene.damping, 0.5 * scene.dt)
        return copied.velocity, copied.spin

    def mean_loads(self, steps: int) -> dict[str, Floats]:
        """Mean force of the grains on each surface since the last asking, (d,) float64, N."""
        loads = self.moving.walls.loads
        mean = self.surfaces.forces(loads.sum(axis=0) / steps)
        loads[:] = 0.0
        return mean

    def state(self) -> dict[str, np.ndarray]:
        """Everything that a continued run needs to go on bit for bit."""
        return to_arrays(self.moving) | {"steps": np.array(self.steps)}

    def restore(self, arrays: dict[str, np.ndarray]) -> None:
        """Go on from what ``state`` gave, with no loads collected yet."""
        self.moving = from_arrays(arrays, self.scene.grain_law, self._lanes)
        self.surfaces.arrays = self.moving.walls.arrays
        self.steps = int(arrays["steps"])
