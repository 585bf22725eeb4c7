"""The step loop of the reference solver, compiled whole."""

from __future__ import annotations

import math
from typing import Any, NamedTuple

import numpy as np

from sandmould.compiled import njit
from sandmould.dem.barrier import wait_for_all
from sandmould.dem.broad_phase import Candidates
from sandmould.dem.contact_law import Law
from sandmould.dem.grains import Floats, Grains, Ints
from sandmould.dem.motion import Damping, drift, kick, turn
from sandmould.dem.near_pairs import NearPairs, look, watch
from sandmould.dem.neighbours import Pairs
from sandmould.dem.pairs import pass_pairs
from sandmould.dem.surface_contacts import surface_forces
from sandmould.dem.surfaces import SurfaceArrays, farthest_moved, move_vertices
from sandmould.dem.vectors import (
    INLINED,
    OPTIONS,
    dot,
    load,
    no_spin,
    no_vector,
    plus,
    store,
    times,
)
from sandmould.dem.wall_history import WallHistory

DONE, LIST_IS_OLD, NOT_A_NUMBER, NO_ROOM = 0, 1, 2, 3
"""Why the loop returned."""


class DemScene(NamedTuple):
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
    travel: Floats
    """(1,) float64, m: how far grains and parts may have moved towards each other since then."""
    due: Floats
    """(p,) float64, m: travel up to which no grain reaches the candidate; none without facets."""


def new_walls(
    arrays: SurfaceArrays, bound: Ints, candidates: Candidates, history: WallHistory
) -> Walls:
    """Surfaces with newly listed candidates and no loads; ``bound`` are those of the chunks."""
    loads = np.zeros((len(bound) - 1, *arrays.vertices.shape))
    first_row = np.searchsorted(candidates.rows, bound)
    # Planes and surfaces of revolution are few, and looked at in no time.
    due = np.zeros(len(candidates.part) if len(arrays.corner) > len(arrays.shape) else 0)
    return Walls(
        arrays, candidates, history, first_row, loads, arrays.vertices.copy(), np.zeros(1), due
    )


class Moving(NamedTuple):
    """What the loop moves."""

    grains: Grains
    ahead: Floats
    """(n, d) float64, m: room for the next positions; see ``exchanged``."""
    coefficients: Floats
    """See ``pair_up``."""
    pairs: Pairs
    near: NearPairs
    lanes: tuple[float, ...]
    """As many zeros as a slice of near pairs has lanes, which compiled code tells from them."""
    bound: Ints
    """(c + 1,) int64: first grains of the chunks."""
    walls: Walls
    orientation: Floats
    """(n, 1) angles or (n, 9) matrices; no row where orientations are not recorded."""
    listed: Floats
    """(n, d) float64, m: positions relative to the box when pairs were listed."""
    reach: Floats
    """(1,) float64, m: how far any grain can still go before pairs must be listed again."""


class Team(NamedTuple):
    """What the threads of one advance share beside the grains."""

    barrier: Ints
    """Counters of ``new_barrier``."""
    speeds2: Floats
    """(c,) float64, m2/s2: largest squared speed in each chunk."""
    state: Ints
    """(1,) int64: why the loop returns."""
    share: Ints
    """(t + 1,) int64: first chunk of each thread."""


def shares(bound: Ints, near: NearPairs, threads: int) -> Ints:
    """Split the chunks among threads, (t + 1,) int64: neighbours together, with equal work.

    Results do not depend on it.
    """
    chunks = len(bound) - 1
    if threads == 1:
        return np.array([0, chunks])
    # A near pair costs about as much as a grain beside its pairs.
    rows = np.concatenate([[0], (near.last_row - near.first_row).cumsum()])[near.first_slice]
    work = np.diff(rows) * near.grain.shape[1] + np.diff(bound)
    ends = np.concatenate([[0], work.cumsum()])
    equal = ends[-1] * np.arange(1, threads) / threads
    nearest = np.abs(ends[:, None] - equal).argmin(axis=0)
    # Every thread has one chunk at least.
    first = np.maximum.accumulate(np.concatenate([[0], nearest]) - np.arange(threads))
    first = np.minimum(first + np.arange(threads), chunks - threads + np.arange(threads))
    return np.append(first, chunks)


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
def exchanged(grains: Grains, ahead: Floats) -> tuple[Grains, Floats]:
    """Grains that have moved on, and room for their next positions.

    Their velocities and spins stand where forces and moments stood, and the other way round.
    """
    return Grains(
        grains.id,
        ahead,
        grains.force,
        grains.moment,
        grains.kind,
        grains.radius_of,
        grains.mass_of,
        grains.inertia_of,
        grains.velocity,
        grains.spin,
    ), grains.position


@njit(**OPTIONS)
def step_chunk(
    dim: Any,
    c: int,
    scene: DemScene,
    moving: Moving,
    grains: Grains,
    ahead: Floats,
    shift: Any,
    speed: Any,
    body: Any,
    dt: float,
    moves: bool,
) -> float:
    """Find all forces on the grains of a chunk, and let them move on where another step follows.

    Gives their largest squared speed, m2/s2.
    """
    walls, first, last = moving.walls, moving.bound[c], moving.bound[c + 1]
    force, moment = grains.force, grains.moment
    for i in range(first, last):
        store(no_vector(dim), force, i)
        store(no_spin(dim), moment, i)
    surface_forces(
        dim,
        walls.first_row[c],
        walls.first_row[c + 1],
        walls.candidates,
        grains.position,
        grains.velocity,
        grains.spin,
        grains.kind,
        grains.radius_of,
        grains.mass_of,
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
        walls.travel[0],
        walls.due,
    )
    fastest2 = pass_pairs(
        dim,
        moving.lanes,
        c,
        grains,
        ahead,
        moving.coefficients,
        moving.near,
        scene.grain_law,
        scene.damping,
        body,
        dt,
        moves,
    )
    if moves and len(moving.orientation):
        turn(dim, first, last, grains.moment, moving.orientation, dt)
    return fastest2


def find_forces(dim: tuple[float, ...], scene: DemScene, moving: Moving) -> None:
    """Find the forces of the places as they are, before any friction; the box is at rest.

    Compiled code does not call it: with constants it would compile ``step_chunk`` a second time.
    ``dim``: ``PLANE`` or ``SPACE``, which is also the shift, speed and body force: none.
    """
    for c in range(len(moving.bound) - 1):
        step_chunk(dim, c, scene, moving, moving.grains, moving.ahead, dim, dim, dim, 0.0, False)


@njit(**INLINED)
def _box(dim: Any, scene: DemScene, displacement: Floats, k: int) -> Any:
    """Shift (m) and velocity (m/s) of the walls at the time k steps after the first."""
    if scene.box_frame:
        return no_vector(dim), no_vector(dim)
    way = displacement[k + 1] - displacement[k]
    return times(scene.direction, displacement[k + 1]), times(scene.direction, way / scene.dt)


@njit(**INLINED)
def _body(dim: Any, scene: DemScene, displacement: Floats, k: int) -> Any:
    """Gravity and, in the frame of the box, minus its acceleration in step k, m/s2."""
    if not scene.box_frame:
        return scene.gravity
    # The second difference of the walls' own motion: the trajectories of moving walls.
    ahead = displacement[k + 2] - displacement[k + 1]
    behind = displacement[k + 1] - displacement[k]
    return plus(scene.gravity, -(ahead - behind) / (scene.dt * scene.dt), scene.direction)


@njit(**OPTIONS)
def _move(dim: Any, c: int, scene: DemScene, moving: Moving, body: Any) -> float:
    """Let the grains of a chunk move on where they are; gives their largest squared speed."""
    first, last = moving.bound[c], moving.bound[c + 1]
    kick(dim, first, last, moving.grains, body, scene.damping, scene.dt)
    if len(moving.orientation):
        turn(dim, first, last, moving.grains.spin, moving.orientation, scene.dt)
    return drift(dim, first, last, moving.grains, scene.dt)


@njit(**OPTIONS)
def _state(
    dim: Any,
    scene: DemScene,
    moving: Moving,
    grains: Grains,
    surfaces_move: bool,
    fastest2: float,
    box: Any,
    half_skin: float,
) -> int:
    """Move deforming surfaces and say whether the lists hold after all grains have moved."""
    if not fastest2 < math.inf:
        return NOT_A_NUMBER
    walls, state = moving.walls, DONE
    shift, speed = box
    way = math.sqrt(fastest2) * scene.dt
    watch(moving.near, way, 2.0 * half_skin)
    # A bound on the way relative to the box; the true way is only looked at beyond it.
    bound = (math.sqrt(fastest2) + math.sqrt(dot(speed, speed))) * scene.dt
    moving.reach[0] -= bound
    walls.travel[0] += bound
    if moving.reach[0] < 0.0:
        moving.reach[0] = half_skin - _farthest(dim, grains, moving.listed, shift)
        if moving.reach[0] < 0.1 * half_skin:
            state = LIST_IS_OLD
    if surfaces_move:
        walls.travel[0] += move_vertices(walls.arrays, scene.dt)
        if farthest_moved(walls.arrays, walls.listed) > 0.9 * half_skin:
            state = LIST_IS_OLD
    return state


@njit(**OPTIONS)
def advance(
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
) -> tuple[int, int]:
    """Compute steps until they are done, lists must be made anew, or numbers go wrong.

    Where the lesser of ``done`` and ``steps - 1`` is odd, grains were exchanged in the end: see
    ``exchanged``.

    Parameters
    ----------
    dim : tuple
        ``PLANE`` or ``SPACE``.
    drifted : bool
        Whether the first step has already moved the grains and waited for new lists.
    displacement : (steps + 2,) float64, m
        Of the box along its direction, from one step before the first.
    half_skin : float, m
    thread, threads : int
        Which of how many threads calls; each computes chunks of its own, and all return alike.

    Returns
    -------
    done : int
        Whole steps done.
    state : int
        ``DONE``, ``NOT_A_NUMBER``, or, the next step having drifted, ``LIST_IS_OLD`` where pairs
        must be listed again and ``NO_ROOM`` where the near ones need more room.
    """
    near, bound, grains, ahead = moving.near, moving.bound, moving.grains, moving.ahead
    mine = range(team.share[thread], team.share[thread + 1])
    barrier, speeds2, state = team.barrier, team.speeds2, team.state
    # Where no vertex moves, none begins to within a call.
    steps_left = moving.walls.arrays.steps_left
    move = len(steps_left) > 0
    for k in range(1 if drifted else 0, steps + 1):
        if k == 0:
            body = _body(dim, scene, displacement, 0)
            for c in mine:
                speeds2[c] = _move(dim, c, scene, moving, body)
        else:
            shift, speed = _box(dim, scene, displacement, k)
            moves = k < steps
            body = _body(dim, scene, displacement, k) if moves else scene.gravity
            for c in mine:
                speeds2[c] = step_chunk(
                    dim, c, scene, moving, grains, ahead, shift, speed, body, scene.dt, moves
                )
            if not moves:
                break
            grains, ahead = exchanged(grains, ahead)
        wait_for_all(barrier, threads)
        if thread == 0:
            box = _box(dim, scene, displacement, k + 1)
            move = move and steps_left.max() >= 0
            state[0] = _state(dim, scene, moving, grains, move, speeds2.max(), box, half_skin)
        wait_for_all(barrier, threads)
        if state[0] != DONE:
            return k, state[0]
        if near.gap[0] >= 0.0:
            for c in mine:
                look(dim, c, bound, grains, moving.pairs, near)
            wait_for_all(barrier, threads)
            if near.full[0]:
                return k, NO_ROOM
    return steps, DONE
