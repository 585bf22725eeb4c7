"""First stage of the contact search, section 3.6: a grid sorts the grains, near pairs are listed.

The grid stands in place of the paper's quadtree: sizes differ by less than a decade, and a
counting sort is the cheapest there is. Grains are stored in the order of its cells, so that
neighbours are near in memory. ``near_pairs`` is the second stage.
"""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np

from sandmould.arrays import Places
from sandmould.compiled import njit
from sandmould.dem.grains import Floats, Grains, Ints
from sandmould.dem.vectors import INLINED, OPTIONS, dim_of, dot, index, load, plus

_ROUNDED = 1.0 + 1e-9
"""Of a squared distance: where a grain lies in its cell is known but for round-off."""


class Pairs(NamedTuple):
    """Pairs of grains nearer than the skin, each with both of its grains."""

    start: Places
    """(n + 1,) uint32: pairs of grain i are start[i] to start[i + 1]."""
    other: Places
    """(p,) uint32: the other grain; those stored earlier come first."""

    @classmethod
    def none(cls) -> Pairs:
        """No pair yet."""
        return cls(np.zeros(1, np.uint32), np.zeros(0, np.uint32))


class Grid(NamedTuple):
    """A grid over a region; grains beyond it belong to its outermost cells."""

    low: Floats
    """(d,) float64, m."""
    counts: Ints
    """(3,) int64: cells along the fastest, middle and slowest axis; 1 where there is none."""
    axes: Ints
    """(d,) int64: axis of space that is the fastest, middle, slowest; the longest last."""
    size: float
    """Edge of a cell, m."""


def make_grid(low: Floats, high: Floats, size: float, grains: int) -> Grid:
    """Lay a grid over a region, with a few cells a grain at most however wide the region is.

    ``low``, ``high``: (d,) float64, m. ``size``, m: least edge of a cell: the reach of the pairs to
    be found.
    """
    span = np.maximum(high - low, size)
    size = max(size, float(np.prod(span) / (4 * grains + 64)) ** (1 / len(span)))
    axes = np.argsort(span, kind="stable")
    counts = np.ones(3, dtype=np.int64)
    counts[: len(span)] = np.maximum(1, span[axes] // size)
    return Grid(np.ascontiguousarray(low), counts, axes, size)


@njit(**OPTIONS)
def extent_of(position: Floats) -> tuple[Floats, Floats]:
    """Smallest and largest coordinates of some grains, (d,) float64 each, m."""
    low, high = position[0].copy(), position[0].copy()
    for i in range(len(position)):
        for k in range(position.shape[1]):
            low[k], high[k] = min(low[k], position[i, k]), max(high[k], position[i, k])
    return low, high


@njit(**OPTIONS)
def sort_into_cells(position: Floats, grid: Grid) -> tuple[Ints, Ints]:
    """Sort grains by cells.

    ``position``, (n, d) float64, m: finite.

    Returns
    -------
    order : (n,) int64
        Grains in the order of their cells.
    start : (c + 1,) int64
        Where the grains of each cell begin in that order.
    """
    n, d = position.shape
    cells = grid.counts[0] * grid.counts[1] * grid.counts[2]
    cell = np.empty(n, dtype=np.int64)
    start = np.zeros(cells + 1, dtype=np.int64)
    for i in range(n):
        number, stride = 0, 1
        for a in range(d):
            far = (position[i, grid.axes[a]] - grid.low[grid.axes[a]]) / grid.size
            number += int(min(max(far, 0.0), grid.counts[a] - 0.5)) * stride
            stride *= grid.counts[a]
        cell[i] = number
        start[number + 1] += 1
    for c in range(cells):
        start[c + 1] += start[c]
    place = start[:-1].copy()
    order = np.empty(n, dtype=np.int64)
    for i in range(n):
        order[place[cell[i]]] = i
        place[cell[i]] += 1
    return order, start


@njit(**INLINED)
def _to_sides(
    position: Floats, i: int | np.uint64, grid: Grid, a: int, cell: int
) -> tuple[float, float]:
    """How far a grain is from the cells before and after its own along an axis of the grid."""
    axis = grid.axes[a]
    far = position[i, axis] - grid.low[axis] - cell * grid.size
    return max(far, 0.0), max(grid.size - far, 0.0)


@njit(**OPTIONS)
def find_pairs(
    dim: Any, grains: Grains, skin: float, start: Ints, grid: Grid
) -> tuple[Places, Places]:
    """List the pairs of grains whose surfaces are nearer than the skin, with the earlier grain.

    Parameters
    ----------
    dim : tuple
        ``PLANE`` or ``SPACE``.
    grains : Grains
        In the order of the cells.
    skin : float, m
    start : (c + 1,) int64
        Of ``sort_into_cells``.

    Returns
    -------
    first : (n + 1,) uint32
        Where the pairs of each grain begin.
    other : (p,) uint32
    """
    position, kind, radius = grains.position, grains.kind, grains.radius_of
    n = len(position)
    first = np.zeros(n + 1, dtype=np.uint32)
    other = np.empty(6 * n + 64, dtype=np.uint32)
    p = 0
    nx, ny, nz = grid.counts[0], grid.counts[1], grid.counts[2]
    largest = radius.max() if n else 0.0
    for cz in range(nz):
        for cy in range(ny):
            for cx in range(nx):
                here = (cz * ny + cy) * nx + cx
                for i in range(start[here], start[here + 1]):
                    x, reach = load(dim, position, i), radius[kind[i]] + skin
                    most2 = (reach + largest) ** 2 * _ROUNDED
                    to_left, to_right = _to_sides(position, i, grid, 0, cx)
                    to_below, to_above = _to_sides(position, i, grid, 1, cy)
                    to_next = _to_sides(position, i, grid, 2, cz)[1] if len(dim) == 3 else 0.0
                    # this row from the grain on, then whole rows ahead: three cells each lie
                    # one after the other in memory
                    for row in range(5):
                        y, z = cy + (0, 1, -1, 0, 1)[row], cz + (0, 0, 1, 1, 1)[row]
                        if y < 0 or y >= ny or z >= nz:
                            continue
                        beside = (0.0, to_above, to_below, 0.0, to_above)[row]
                        ahead = (0.0, 0.0, to_next, to_next, to_next)[row]
                        across2 = beside * beside + ahead * ahead
                        if across2 > most2:
                            continue
                        base = (z * ny + y) * nx + cx
                        left = cx > 0 and across2 + to_left * to_left <= most2
                        right = cx < nx - 1 and across2 + to_right * to_right <= most2
                        begin = start[base - left] if row else i + 1
                        end = start[base + 1 + right]
                        if p + end - begin > len(other):
                            longer = np.empty(2 * (p + end - begin), dtype=np.uint32)
                            longer[:p] = other[:p]
                            other = longer
                        for j in range(begin, end):
                            apart = plus(load(dim, position, j), -1.0, x)
                            far = reach + radius[kind[j]]
                            # Written at all events: a branch here is guessed wrong too often.
                            other[index(p)] = j
                            p += dot(apart, apart) < far * far
                    first[i + 1] = p
    return first, other[:p].copy()


@njit(**OPTIONS)
def _of_both(first: Places, second: Places) -> tuple[Places, Places]:
    """List pairs with both of their grains."""
    n = len(first) - 1
    start = np.zeros(n + 1, dtype=np.uint32)
    for i in range(n):
        start[i + 1] += first[i + 1] - first[i]
        for p in range(first[i], first[i + 1]):
            start[second[p] + 1] += 1
    for i in range(n):
        start[i + 1] += start[i]
    filled, other = start[:-1].copy(), np.empty(2 * len(second), dtype=np.uint32)
    for i in range(n):
        for p in range(first[i], first[i + 1]):
            j = second[p]
            other[filled[i]], other[filled[j]] = j, i
            filled[i] += 1
            filled[j] += 1
    return start, other


def list_pairs(grains: Grains, start: Ints, grid: Grid, skin: float) -> Pairs:
    """List near pairs of sorted grains."""
    dim = dim_of(grains.position.shape[1])
    return Pairs(*_of_both(*find_pairs(dim, grains, skin, start, grid)))
