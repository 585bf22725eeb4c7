"""Contact of a pattern that is stepped inside an engine with floor, walls and, in 2D, obstacles.

As in the other schemes gaps do not close beyond zero, reactions only press, and there is no
friction. The forces act over the step that would close a gap too far and are just what leaves it
closed at its end (forward increment Lagrange multipliers; Carpenter, Taylor and Katona,
International Journal for Numerical Methods in Engineering 32, 1991): vertices stop without rebound,
and no stiffness of contact bounds the step. They are found by projected Gauss-Seidel sweeps.
"""

from __future__ import annotations

import math
from typing import Any, NamedTuple

import numpy as np

from sandmould.arrays import Floats, Ints
from sandmould.compiled import njit
from sandmould.dem.vectors import OPTIONS

_SWEEPS = 200
_SMALL = 1e-12
"""Change of a gap in a sweep, m, below which no other follows."""


class ContactArrays(NamedTuple):
    """What a pattern may touch, and what is known of it; components as in ``FoamArrays``."""

    low: Floats
    high: Floats
    """(n,) float64, m: displacements at which floor and walls are met; infinite where none is."""
    segments: Floats
    """(k, 4) float64, m: sides of obstacles, x and y of their ends, solid on the left."""
    starts: Ints
    """(solids + 1,) int64: first side of each obstacle, and their number."""
    corners: Floats
    """(c, 2) float64, m: of obstacles."""
    drawn: Floats
    """(nv, d) float64, m: vertices that may touch."""
    clear: Floats
    """(nv + 1,) float64, m: distance of each vertex from the obstacles, and that of their corners
    from the pattern, at the displacement ``clear_at``."""
    clear_at: Floats
    """(nv, 2) float64, m."""
    wall: Floats
    """(n,) float64, kg m: of floor and walls in the last step, times the square of a step."""
    push: Floats
    """(n,) float64, N: all forces of contact in the last step."""
    push_sum: Floats
    """(n,) float64, N: since the last record."""


@njit(**OPTIONS)
def _nearest(
    x: float, y: float, lines: Floats, first: int, last: int
) -> tuple[float, float, float, int, float]:
    """Signed distance of a point from a closed line, its slope, and the side and share of it."""
    best2, inside, side, share = math.inf, False, first, 0.0
    for k in range(first, last):
        ax, ay, bx, by = lines[k, 0], lines[k, 1], lines[k, 2], lines[k, 3]
        ex, ey = bx - ax, by - ay
        along = ((x - ax) * ex + (y - ay) * ey) / (ex * ex + ey * ey)
        along = min(1.0, max(0.0, along))
        away2 = (x - ax - along * ex) ** 2 + (y - ay - along * ey) ** 2
        if away2 < best2:
            best2, side, share = away2, k, along
        if (ay > y) != (by > y) and x < ax + (y - ay) / ey * ex:
            inside = not inside
    ex, ey = lines[side, 2] - lines[side, 0], lines[side, 3] - lines[side, 1]
    length, distance = math.sqrt(ex * ex + ey * ey), math.sqrt(best2)
    nx, ny = ey / length, -ex / length
    sign = -1.0 if inside else 1.0
    if distance > 1e-9 * length:
        nx = sign * (x - lines[side, 0] - share * ex) / distance
        ny = sign * (y - lines[side, 1] - share * ey) / distance
    return sign * distance, nx, ny, side, share


@njit(**OPTIONS)
def _from_solids(x: float, y: float, c: Any) -> tuple[float, float, float]:
    """Signed distance of a point from the nearest obstacle, and its slope."""
    distance, nx, ny = math.inf, 0.0, 0.0
    for k in range(len(c.starts) - 1):
        away, ax, ay, _, _ = _nearest(x, y, c.segments, c.starts[k], c.starts[k + 1])
        if away < distance:
            distance, nx, ny = away, ax, ay
    return distance, nx, ny


@njit(**OPTIONS)
def _outline(c: Any, pressed: Ints, moved: Floats) -> Floats:
    """Sides of the pattern where it has come to, (nv, 4) float64, m."""
    count = len(c.drawn)
    lines = np.empty((count, 4))
    for v in range(count):
        before = (v - 1) % count
        for axis in range(2):
            place = c.drawn[v, axis] + moved[pressed[2 * v + axis]]
            lines[v, axis] = place
            lines[before, 2 + axis] = place
    return lines


@njit(**OPTIONS)
def _is_clear(c: Any, pressed: Ints, moved: Floats) -> bool:
    """Whether no vertex has gone as far as it was from the obstacles."""
    most2 = 0.0
    for v in range(len(c.drawn)):
        way2 = 0.0
        for axis in range(2):
            way2 += (moved[pressed[2 * v + axis]] - c.clear_at[v, axis]) ** 2
        if way2 > 0.0 and way2 >= c.clear[v] * abs(c.clear[v]):
            return False
        most2 = max(most2, way2)
    last = c.clear[len(c.drawn)]
    return most2 < last * abs(last)


@njit(**OPTIONS)
def _measure(c: Any, pressed: Ints, moved: Floats) -> None:
    count = len(c.drawn)
    for v in range(count):
        x, y = moved[pressed[2 * v]], moved[pressed[2 * v + 1]]
        c.clear_at[v, 0], c.clear_at[v, 1] = x, y
        c.clear[v] = _from_solids(c.drawn[v, 0] + x, c.drawn[v, 1] + y, c)[0]
    lines = _outline(c, pressed, moved)
    least = math.inf
    for k in range(len(c.corners)):
        least = min(least, _nearest(c.corners[k, 0], c.corners[k, 1], lines, 0, count)[0])
    c.clear[count] = least


@njit(**OPTIONS)
def _obstacle_rows(
    c: Any, pressed: Ints, before: Floats, moved: Floats, at: Ints, share: Floats, gap: Floats,
    count: int,
) -> int:  # fmt: skip
    """Add the places where vertices may meet obstacles, or these the pattern; give their number."""
    vertices, most = len(c.drawn), 0.0
    for v in range(vertices):
        i, j = pressed[2 * v], pressed[2 * v + 1]
        way_x, way_y = moved[i] - before[i], moved[j] - before[j]
        way = math.sqrt(way_x * way_x + way_y * way_y)
        most = max(most, way)
        away, nx, ny = _from_solids(c.drawn[v, 0] + before[i], c.drawn[v, 1] + before[j], c)
        if away <= 2.0 * way + _SMALL:
            at[count, :] = 0
            share[count, :] = 0.0
            at[count, 0], at[count, 1] = i, j
            share[count, 0], share[count, 1] = nx, ny
            gap[count] = away + nx * way_x + ny * way_y
            count += 1
    lines = _outline(c, pressed, before)
    for k in range(len(c.corners)):
        away, nx, ny, side, along = _nearest(c.corners[k, 0], c.corners[k, 1], lines, 0, vertices)
        if away > 2.0 * most + _SMALL:
            continue
        following = (side + 1) % vertices
        gap[count] = away
        for end in range(2):
            v, part = (side, 1.0 - along) if end == 0 else (following, along)
            for axis in range(2):
                entry, slot = pressed[2 * v + axis], 2 * end + axis
                at[count, slot] = entry
                share[count, slot] = -part * (nx if axis == 0 else ny)
                gap[count] += share[count, slot] * (moved[entry] - before[entry])
        count += 1
    return count


@njit(**OPTIONS)
def _sweep(matrix: Floats, gap: Floats, reaction: Floats, count: int) -> None:
    """Find reactions that open the gaps: r >= 0, w = C r + g >= 0, r w = 0; gaps become w."""
    for r in range(count):
        for q in range(count):
            gap[q] += matrix[q, r] * reaction[r]
    for _ in range(_SWEEPS):
        largest = 0.0
        for r in range(count):
            own = matrix[r, r]
            if own <= 0.0:
                continue
            new = max(0.0, reaction[r] - gap[r] / own)
            change = new - reaction[r]
            if change != 0.0:
                reaction[r] = new
                largest = max(largest, abs(change) * own)
                for q in range(count):
                    gap[q] += matrix[q, r] * change
        if largest < _SMALL:
            return


@njit(**OPTIONS)
def _wall_rows(c: Any, moved: Floats, at: Ints, share: Floats, gap: Floats, old: Floats) -> int:
    """Components beyond floor or walls, or pressed by them before; give their number."""
    count = 0
    for i in range(len(moved)):
        below = moved[i] < c.low[i] or c.wall[i] > 0.0
        if below or moved[i] > c.high[i] or c.wall[i] < 0.0:
            at[count, :] = 0
            share[count, :] = 0.0
            at[count, 0] = i
            share[count, 0] = 1.0 if below else -1.0
            gap[count] = moved[i] - c.low[i] if below else c.high[i] - moved[i]
            old[count] = abs(c.wall[i])
            count += 1
    return count


@njit(**OPTIONS)
def _touches(c: Any, pressed: Ints, before: Floats, moved: Floats) -> tuple[bool, bool]:
    """Whether floor or walls, and whether obstacles may be met in this step."""
    walls = False
    for i in range(len(moved)):
        if moved[i] < c.low[i] or moved[i] > c.high[i] or c.wall[i] != 0.0:
            walls = True
            break
    obstacles = False
    if len(c.segments) > 0 and not _is_clear(c, pressed, moved):
        _measure(c, pressed, before)
        obstacles = not _is_clear(c, pressed, moved)
    return walls, obstacles


@njit(**OPTIONS)
def hold_out(
    c: Any, pressed: Ints, inverse: Floats, before: Floats, moved: Floats, impulse: Floats
) -> bool:
    """Take a step anew with the reactions of what the pattern would enter.

    Whether there are any; else ``impulse`` is left as it is.

    Parameters
    ----------
    c : ContactArrays, or what has its fields
    pressed : (2 nv,) int64
    inverse : (n, n) float64, 1/kg
        Of the mass, symmetric; 0 in rows of held components.
    before, moved : (n,) float64, m
        Displacements before and after the step; the latter is changed.
    impulse : (n,) float64, kg m
        Overwritten: what reactions add to the product of mass and displacement.
    """
    walls, obstacles = _touches(c, pressed, before, moved)
    if not walls and not obstacles:
        return False
    n = len(moved)
    most = n + len(c.drawn) + len(c.corners)
    at, share = np.empty((most, 4), dtype=np.int64), np.empty((most, 4))
    gap, reaction = np.zeros(most), np.zeros(most)
    of_walls = _wall_rows(c, moved, at, share, gap, reaction)
    count = of_walls
    if obstacles:
        count = _obstacle_rows(c, pressed, before, moved, at, share, gap, count)
    moves, matrix = np.zeros((count, n)), np.zeros((count, count))
    for r in range(count):
        for k in range(4):
            if share[r, k] != 0.0:
                moves[r] += share[r, k] * inverse[at[r, k]]
    for r in range(count):
        for q in range(count):
            for k in range(4):
                matrix[q, r] += share[q, k] * moves[r, at[q, k]]
    _sweep(matrix, gap, reaction, count)
    impulse[:] = 0.0
    c.wall[:] = 0.0
    for r in range(count):
        if reaction[r] > 0.0:
            moved += reaction[r] * moves[r]
            for k in range(4):
                impulse[at[r, k]] += reaction[r] * share[r, k]
            if r < of_walls:
                c.wall[at[r, 0]] = reaction[r] * share[r, 0]
    return True
