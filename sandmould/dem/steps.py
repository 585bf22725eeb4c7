"""The step loop of the reference solver, compiled whole."""

from __future__ import annotations

import math
from typing import Any, NamedTuple

import numpy as np
from numba import njit, prange
from numba.extending import register_jitable

from sandmould.dem.broad_phase import Candidates
from sandmould.dem.contact_law import Law
from sandmould.dem.grains import Floats, Grains, Ints
from sandmould.dem.motion import Damping, drift, kick, turn
from sandmould.dem.neighbours import Pairs
from sandmould.dem.pairs import Chunks, gather_incoming, press_pairs
from sandmould.dem.surface_contacts import press_on_surfaces
from sandmould.dem.surfaces import SurfaceArrays, farthest_moved, move_vertices
from sandmould.dem.vectors import OPTIONS, dot, load, no_vector, plus, times
from sandmould.dem.wall_history import WallHistory

DONE, LIST_IS_OLD, NOT_A_NUMBER = 0, 1, 2
"""Why the loop returned."""


class Scene(NamedTuple):
    """What does not change while the loop runs."""

    grain_law: Law
    wall_law: Law
    damping: Damping
    gravity: tuple[float, ...]
    """d floats, m/s2."""
    direction: tuple[float, ...]
    """d floats: unit vector along which the box moves."""
    box_frame: bool
    """Whether grains move in the frame of the box, eq. (58), or the walls move, eq. (57)."""
    dt: float
    """Time step, s."""


class Walls(NamedTuple):
    """Surfaces and the grains near them."""

    arrays: SurfaceArrays
    candidates: Candidates
    history: WallHistory
    first_row: Ints
    """(c + 1,) int64: first row of the candidates of each chunk."""
    loads: Floats
    """(c, nv, d) float64, N: sum over steps of what each chunk puts on the vertices, eq. (56)."""
    listed: Floats
    """(nv, d) float64, m: vertices when candidates were listed."""


class Moving(NamedTuple):
    """What the loop moves."""

    grains: Grains
    pairs: Pairs
    chunks: Chunks
    walls: Walls
    orientation: Floats
    """(n, 1) angles or (n, 9) matrices; no row where orientations are not recorded."""
    listed: Floats
    """(n, d) float64, m: positions relative to the box when pairs were listed."""
    reach: Floats
    """(1,) float64, m: how far any grain can still go before pairs must be listed again."""


@njit(**OPTIONS)
def _farthest(dim: Any, grains: Grains, listed: Floats, shift: Any) -> float:
    """Longest way that a grain has gone relative to the box since pairs were listed, m."""
    longest2 = 0.0
    for i in range(len(listed)):
        way = plus(load(dim, grains.position, i), -1.0, load(dim, listed, i))
        way = plus(way, -1.0, shift)
        longest2 = max(longest2, dot(way, way))
    return math.sqrt(longest2)


@njit(**OPTIONS)
def _press(
    dim: Any, c: int, scene: Scene, moving: Moving, shift: Any, speed: Any, dt: float
) -> None:
    """Add all forces on the grains of a chunk but those of earlier chunks."""
    grains, walls = moving.grains, moving.walls
    press_pairs(dim, c, moving.chunks, grains, moving.pairs, scene.grain_law, dt)
    press_on_surfaces(
        dim,
        walls.first_row[c],
        walls.first_row[c + 1],
        walls.candidates,
        grains.position,
        grains.velocity,
        grains.spin,
        grains.radius,
        grains.mass,
        grains.force,
        grains.moment,
        walls.arrays,
        shift,
        speed,
        scene.wall_law,
        dt,
        True,
        walls.history,
        walls.loads[c],
    )


@njit(**OPTIONS)
def find_forces(dim: Any, scene: Scene, moving: Moving) -> None:
    """Find the forces of the places as they are, before any friction; the box is at rest.

    Parameters
    ----------
    dim : tuple
    scene : Scene
    moving : Moving
        Its grains' forces are zero before.
    """
    for c in range(len(moving.chunks.bound) - 1):
        _press(dim, c, scene, moving, no_vector(dim), no_vector(dim), 0.0)
    for c in range(len(moving.chunks.bound) - 1):
        gather_incoming(dim, c, moving.chunks, moving.grains)


@register_jitable(inline="always")
def _loop(
    dim: Any,
    steps: int,
    drifted: bool,
    scene: Scene,
    moving: Moving,
    displacement: Floats,
    half_skin: float,
) -> tuple[int, int]:
    grains, chunks, walls = moving.grains, moving.chunks, moving.walls
    deforming = walls.arrays.steps_left.max() >= 0 if len(walls.arrays.steps_left) else False
    number = len(chunks.bound) - 1
    dt = scene.dt
    speeds2 = np.empty(number)
    for done in range(steps):
        before, now, ahead = displacement[done], displacement[done + 1], displacement[done + 2]
        body = scene.gravity
        shift, speed = no_vector(dim), no_vector(dim)
        if scene.box_frame:
            body = plus(body, -((ahead - now) - (now - before)) / (dt * dt), scene.direction)
        else:
            shift = times(scene.direction, ahead)
            speed = times(scene.direction, (ahead - now) / dt)
        if not drifted:
            for c in prange(number):
                first, last = chunks.bound[c], chunks.bound[c + 1]
                kick(dim, first, last, grains, body, scene.damping, dt)
                if len(moving.orientation):
                    turn(dim, first, last, grains, moving.orientation, dt)
                speeds2[c] = drift(dim, first, last, grains, dt)
            fastest2 = speeds2.max()
            if not fastest2 < math.inf:
                return done, NOT_A_NUMBER
            # A bound on the way relative to the box; the true way is only looked at beyond it.
            moving.reach[0] -= (math.sqrt(fastest2) + math.sqrt(dot(speed, speed))) * dt
            if moving.reach[0] < 0.0:
                moving.reach[0] = half_skin - _farthest(dim, grains, moving.listed, shift)
                if moving.reach[0] < 0.1 * half_skin:
                    return done, LIST_IS_OLD
            if deforming:
                move_vertices(walls.arrays, dt)
                if farthest_moved(walls.arrays, walls.listed) > 0.9 * half_skin:
                    return done, LIST_IS_OLD
        drifted = False
        for c in prange(number):
            _press(dim, c, scene, moving, shift, speed, dt)
        if number > 1:
            for c in prange(number):
                gather_incoming(dim, c, chunks, grains)
    return steps, DONE


@njit(**OPTIONS)
def advance(
    dim: Any,
    steps: int,
    drifted: bool,
    scene: Scene,
    moving: Moving,
    displacement: Floats,
    half_skin: float,
) -> tuple[int, int]:
    """Compute steps until they are done, pairs must be listed again, or numbers go wrong.

    Parameters
    ----------
    dim : tuple
        ``PLANE`` or ``SPACE``.
    steps : int
    drifted : bool
        Whether the first step has already moved the grains and waited for a new list.
    scene : Scene
    moving : Moving
    displacement : (steps + 2,) float64, m
        Of the box along its direction, from one step before the first.
    half_skin : float, m

    Returns
    -------
    done : int
        Whole steps done.
    state : int
        ``DONE``, ``LIST_IS_OLD`` (the next step has drifted) or ``NOT_A_NUMBER``.
    """
    return _loop(dim, steps, drifted, scene, moving, displacement, half_skin)


@njit(parallel=True, **OPTIONS)
def advance_threaded(
    dim: Any,
    steps: int,
    drifted: bool,
    scene: Scene,
    moving: Moving,
    displacement: Floats,
    half_skin: float,
) -> tuple[int, int]:
    """As ``advance``, chunks shared among numba's threads; the numbers are the same."""
    return _loop(dim, steps, drifted, scene, moving, displacement, half_skin)
