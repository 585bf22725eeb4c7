"""Which grains may soon touch which parts of the surfaces: the global stage of section 3.6.

Facets are sorted into cubic cells, so that a grain finds those it may touch.
"""

from __future__ import annotations

import math
from typing import Any, NamedTuple

import numpy as np

from sandmould.arrays import Floats, Ints, Places, WholeNumbers
from sandmould.compiled import njit
from sandmould.dem.nearest_point import nearest
from sandmould.dem.surfaces import SurfaceArrays, farthest_moved
from sandmould.dem.vectors import OPTIONS, dot, load, plus, times

_ROUNDED = 1e-9
"""Of a cell: where something lies is known but for round-off."""


class FacetGrid(NamedTuple):
    """Facets in cubic cells, each in all cells that it passes through, in increasing order."""

    low: tuple[float, float, float]
    """Corner of the first cell, m; in 2D the third is 0."""
    size: float
    """Edge of a cell, m."""
    cells: tuple[int, int, int]
    """Along x, y and z; those along z lie one after the other."""
    start: Ints
    """(c + 1,) int64: where the parts of each cell begin."""
    part: Places
    """(start[c],) uint32: part numbers, see ``SurfaceArrays``."""


@njit(**OPTIONS)
def _flat_normal(dim: Any, vertices: Floats, corner: Ints) -> Any:
    """Unit normal of a facet, three components."""
    a, b = load(dim, vertices, corner[0]), load(dim, vertices, corner[1])
    ab = plus(b, -1.0, a)
    if len(dim) == 2:
        n = (-ab[1], ab[0], 0.0)
    else:
        ac = plus(load(dim, vertices, corner[2]), -1.0, a)
        n = (
            ab[1] * ac[2] - ab[2] * ac[1],
            ab[2] * ac[0] - ab[0] * ac[2],
            ab[0] * ac[1] - ab[1] * ac[0],
        )
    return times(n, 1.0 / math.sqrt(dot(n, n)))


@njit(**OPTIONS)
def _span(vertices: Floats, corner: Ints, k: int) -> tuple[float, float]:
    low, high = math.inf, -math.inf
    for j in range(len(corner)):
        low, high = min(low, vertices[corner[j], k]), max(high, vertices[corner[j], k])
    return low, high


@njit(**OPTIONS)
def _bounds(dim: Any, vertices: Floats, corner: Ints) -> Any:
    """Smallest and largest coordinates of a facet, three each; in 2D the third is 0."""
    x, y, z = _span(vertices, corner, 0), _span(vertices, corner, 1), (0.0, 0.0)
    if len(dim) == 3:
        z = _span(vertices, corner, 2)
    return (x[0], y[0], z[0]), (x[1], y[1], z[1])


@njit(**OPTIONS)
def cells_of(grid: FacetGrid, low: Any, high: Any, k: int) -> tuple[int, int]:
    """First and last cell of an interval along axis k; the last is less where it meets none."""
    first = math.floor((low[k] - grid.low[k]) / grid.size - _ROUNDED)
    last = math.floor((high[k] - grid.low[k]) / grid.size + _ROUNDED)
    cells = float(grid.cells[k])
    return int(min(max(first, 0.0), cells)), int(max(min(last, cells - 1.0), -1.0))


@njit(**OPTIONS)
def _empty(dim: Any, arrays: SurfaceArrays, reach: float) -> FacetGrid:
    """Lay a grid over all facets, its cells about as large as they and as the reach of grains."""
    corner, first_facet = arrays.corner, len(arrays.shape)
    facets, extent = len(corner) - first_facet, 0.0
    low, high = (0.0, 0.0, 0.0), (0.0, 0.0, 0.0)
    for p in range(first_facet, len(corner)):
        a, b = _bounds(dim, arrays.vertices, corner[p])
        extent += max(b[0] - a[0], b[1] - a[1], b[2] - a[2]) / facets
        if p == first_facet:
            low, high = a, b
        low = (min(low[0], a[0]), min(low[1], a[1]), min(low[2], a[2]))
        high = (max(high[0], b[0]), max(high[1], b[1]), max(high[2], b[2]))
    size = min(max(extent, 0.5 * reach), 2.0 * reach)
    while True:
        cells = (
            math.floor((high[0] - low[0]) / size) + 1.0,
            math.floor((high[1] - low[1]) / size) + 1.0,
            math.floor((high[2] - low[2]) / size) + 1.0,
        )
        if not cells[0] * cells[1] * cells[2] > 4.0 * facets + 100_000.0:
            break
        size *= 1.25
    n_x, n_y, n_z = int(cells[0]), int(cells[1]), int(cells[2])
    start = np.zeros(n_x * n_y * n_z + 1, dtype=np.int64)
    return FacetGrid(low, size, (n_x, n_y, n_z), start, np.empty(0, dtype=np.uint32))


@njit(**OPTIONS)
def sort_facets(dim: Any, arrays: SurfaceArrays, reach: float) -> FacetGrid:
    """Sort facets into cells.

    ``dim``: tuple of d floats. ``reach``, m: how far from a grain's centre facets are asked for.
    """
    empty = _empty(dim, arrays, reach)
    vertices, corner = arrays.vertices, arrays.corner
    start, part, size, low = empty.start, empty.part, empty.size, empty.low
    _, n_y, n_z = empty.cells
    for fill in range(2):
        for p in range(len(arrays.shape), len(corner)):
            lowest, highest = _bounds(dim, vertices, corner[p])
            normal = _flat_normal(dim, vertices, corner[p])
            height = 0.0
            for k in range(len(dim)):
                height += normal[k] * vertices[corner[p, 0], k]
            thick = (0.5 + _ROUNDED) * size * (abs(normal[0]) + abs(normal[1]) + abs(normal[2]))
            x_0, x_1 = cells_of(empty, lowest, highest, 0)
            y_0, y_1 = cells_of(empty, lowest, highest, 1)
            z_0, z_1 = cells_of(empty, lowest, highest, 2)
            for i_x in range(x_0, x_1 + 1):
                for i_y in range(y_0, y_1 + 1):
                    for i_z in range(z_0, z_1 + 1):
                        middle = (
                            low[0] + (i_x + 0.5) * size,
                            low[1] + (i_y + 0.5) * size,
                            low[2] + (i_z + 0.5) * size,
                        )
                        if abs(dot(normal, middle) - height) <= thick:
                            cell = (i_x * n_y + i_y) * n_z + i_z
                            if fill:
                                part[start[cell]] = p
                                start[cell] += 1
                            else:
                                start[cell + 1] += 1
        if not fill:
            for cell in range(1, len(start)):
                start[cell] += start[cell - 1]
            part = np.empty(start[-1], dtype=np.uint32)
    # Filling has moved each start to the next one.
    for cell in range(len(start) - 1, 0, -1):
        start[cell] = start[cell - 1]
    start[0] = 0
    return FacetGrid(low, size, empty.cells, start, part)


class FacetGrids:
    """The grid of a scene's facets, sorted anew only where they have moved or others have come."""

    def __init__(self) -> None:
        self._corner: Ints | None = None
        self._vertices_m: Floats = np.zeros((0, 0))

    def of(self, dim: Any, arrays: SurfaceArrays, reach_m: float) -> tuple[FacetGrid, float]:
        """Give a grid of facets, and how far any of them has moved since they were sorted, m."""
        moved_m = math.inf
        if self._corner is arrays.corner:
            moved_m = farthest_moved(arrays, self._vertices_m)
        if moved_m > 0.25 * reach_m:
            self._corner, self._vertices_m = arrays.corner, arrays.vertices.copy()
            self._grid, moved_m = sort_facets(dim, arrays, reach_m), 0.0
        return self._grid, moved_m


class Candidates(NamedTuple):
    """Grains near surfaces and the parts that they are near to."""

    rows: WholeNumbers
    """(m,) uint32: grains with at least one part within reach, in increasing order."""
    start: WholeNumbers
    """(m + 1,) uint32: where the parts of each row begin."""
    part: WholeNumbers
    """(start[m],) uint32: part numbers, see ``SurfaceArrays``."""


@njit(**OPTIONS)
def _longer(array: Places, filled: int) -> Places:
    longer = np.empty(2 * filled + 16, dtype=np.uint32)
    for i in range(filled):
        longer[i] = array[i]
    return longer


@njit(**OPTIONS)
def _sort_row(parts: Places, first: int, last: int) -> None:
    for k in range(first + 1, last):
        part, q = parts[k], k
        while q > first and parts[q - 1] > part:
            parts[q] = parts[q - 1]
            q -= 1
        parts[q] = part


@njit(**OPTIONS)
def candidates_in(
    dim: Any,
    position: Floats,
    radius: Floats,
    skin: float,
    arrays: SurfaceArrays,
    shift: Any,
    grid: FacetGrid,
    moved: float,
) -> Candidates:
    """Find all parts whose distance from a grain's centre is at most radius + skin.

    The list holds as long as no grain has moved by more than the skin relative to any surface.

    Parameters
    ----------
    position : (n, d or 3) float64, m
    radius : (n,) float64, m
    skin : float, m
    shift : tuple of d floats, m
        Displacement of the box.
    moved : float, m
        How far any facet has moved since it was sorted into the grid.
    """
    vertices, shape, corner = arrays.vertices, arrays.shape, arrays.corner
    planes = arrays.planes[0]
    grains, first_facet = len(radius), len(shape)
    rows, parts = np.empty(16, dtype=np.uint32), np.empty(16, dtype=np.uint32)
    start = np.zeros(17, dtype=np.uint32)
    m = listed = 0
    _, n_y, n_z = grid.cells
    cell_start, cell_part = grid.start, grid.part
    # A facet lies in several cells: the grain that has last met it.
    met = np.full(len(corner), -1, dtype=np.int64)
    # Plane by plane for all grains: most are near none.
    near_planes = np.zeros(grains, dtype=np.bool_)
    for p in range(planes):
        normal = load(dim, shape, p)
        height = dot(load(dim, vertices, corner[p, 0]), normal)
        for i in range(grains):
            x = plus(load(dim, position, i), -1.0, shift)
            near_planes[i] |= dot(x, normal) - height <= radius[i] + skin
    for i in range(grains):
        x = plus(load(dim, position, i), -1.0, shift)
        near = radius[i] + skin
        before = listed
        for p in range(0 if near_planes[i] else planes, first_facet):
            if nearest(dim, vertices, planes, shape, corner, p, x, near)[0] <= near:
                if listed == len(parts):
                    parts = _longer(parts, listed)
                parts[listed] = p
                listed += 1
        if len(cell_part) and dot(x, x) < math.inf:
            reach = near + moved
            z = x[2] if len(dim) == 3 else 0.0
            lowest = (x[0] - reach, x[1] - reach, z - reach)
            highest = (x[0] + reach, x[1] + reach, z + reach)
            x_0, x_1 = cells_of(grid, lowest, highest, 0)
            y_0, y_1 = cells_of(grid, lowest, highest, 1)
            z_0, z_1 = cells_of(grid, lowest, highest, 2)
            if z_0 > z_1:
                x_0, x_1 = 1, 0
            found = listed
            for i_x in range(x_0, x_1 + 1):
                for i_y in range(y_0, y_1 + 1):
                    column = (i_x * n_y + i_y) * n_z
                    for k in range(cell_start[column + z_0], cell_start[column + z_1 + 1]):
                        p = int(cell_part[k])
                        if met[p] == i:
                            continue
                        met[p] = i
                        if nearest(dim, vertices, planes, shape, corner, p, x, near)[0] <= near:
                            if listed == len(parts):
                                parts = _longer(parts, listed)
                            parts[listed] = p
                            listed += 1
            _sort_row(parts, found, listed)
        if listed > before:
            if m == len(rows):
                rows, start = _longer(rows, m), _longer(start, m + 1)
            rows[m] = i
            m += 1
            start[m] = listed
    return Candidates(rows[:m].copy(), start[: m + 1].copy(), parts[:listed].copy())


@njit(**OPTIONS)
def find_candidates(
    dim: Any,
    position: Floats,
    radius: Floats,
    skin: float,
    arrays: SurfaceArrays,
    shift: Any,
) -> Candidates:
    """Do the same with a grid of its own, where none is kept."""
    reach = skin
    for i in range(len(radius)):
        reach = max(reach, skin + radius[i])
    grid = sort_facets(dim, arrays, reach)
    return candidates_in(dim, position, radius, skin, arrays, shift, grid, 0.0)
