"""Which grains may soon touch which parts of the surfaces: the global stage of section 3.6."""

from __future__ import annotations

import math
from typing import Any, NamedTuple

import numpy as np

from sandmould.arrays import Floats, Ints
from sandmould.compiled import njit
from sandmould.dem.nearest_point import nearest
from sandmould.dem.surfaces import SurfaceArrays
from sandmould.dem.vectors import OPTIONS, dot, load, plus, store, times


class Candidates(NamedTuple):
    """Grains near surfaces and the parts that they are near to."""

    rows: Ints
    """(m,) int64: grains with at least one part within reach, in increasing order."""
    start: Ints
    """(m + 1,) int64: where the parts of each row begin."""
    part: Ints
    """(start[m],) int64: part numbers, see ``SurfaceArrays``."""


class _Grid(NamedTuple):
    """Facets sorted into cubic cells, all within reach of a grain in the cell."""

    low: tuple[float, float, float]
    size: float
    cells: tuple[int, int, int]
    start: Ints
    part: Ints


@njit(**OPTIONS)
def _span(points: Floats, k: int) -> tuple[float, float]:
    """Smallest and largest of a coordinate."""
    low, high = math.inf, -math.inf
    for i in range(len(points)):
        low, high = min(low, points[i, k]), max(high, points[i, k])
    return low, high


@njit(**OPTIONS)
def _bounds(dim: Any, points: Floats) -> Any:
    """Smallest and largest coordinates, three each; in 2D the third is 0."""
    x, y, z = _span(points, 0), _span(points, 1), (0.0, 0.0)
    if len(dim) == 3:
        z = _span(points, 2)
    return (x[0], y[0], z[0]), (x[1], y[1], z[1])


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
def _range(low: float, high: float, origin: float, size: float, cells: int) -> tuple[int, int]:
    """First and last cell of an interval along one axis."""
    first, last = math.floor((low - origin) / size), math.floor((high - origin) / size)
    return int(max(first, 0)), int(min(last, cells - 1))


@njit(**OPTIONS)
def _sort_facets(
    dim: Any,
    vertices: Floats,
    corner: Ints,
    first_facet: int,
    reach: float,
    low: Any,
    high: Any,
) -> _Grid:
    """Sort facets into cells of a box; a facet lies in every cell that a grain may touch it from.

    The cells of a facet are those of its bounding box that its plane comes near to.
    """
    size = 2.0 * reach
    most = 4.0 * len(corner) + 100_000.0
    cells = (0.0, 0.0, 0.0)
    while True:
        cells = (
            math.floor((high[0] - low[0]) / size) + 1.0,
            math.floor((high[1] - low[1]) / size) + 1.0,
            math.floor((high[2] - low[2]) / size) + 1.0,
        )
        if not cells[0] * cells[1] * cells[2] > most:
            break
        size *= 1.25
    n_x, n_y, n_z = int(cells[0]), int(cells[1]), int(cells[2])
    start = np.zeros(n_x * n_y * n_z + 1, dtype=np.int64)
    part = np.empty(0, dtype=np.int64)
    corners = np.empty((len(dim), len(dim)))
    for fill in range(2):
        for p in range(first_facet, len(corner)):
            for j in range(len(dim)):
                store(load(dim, vertices, corner[p, j]), corners, j)
            lowest, highest = _bounds(dim, corners)
            normal = _flat_normal(dim, vertices, corner[p])
            height = 0.0
            for k in range(len(dim)):
                height += normal[k] * corners[0, k]
            thick = reach + 0.5 * size * (abs(normal[0]) + abs(normal[1]) + abs(normal[2]))
            x_0, x_1 = _range(lowest[0] - reach, highest[0] + reach, low[0], size, n_x)
            y_0, y_1 = _range(lowest[1] - reach, highest[1] + reach, low[1], size, n_y)
            z_0, z_1 = _range(lowest[2] - reach, highest[2] + reach, low[2], size, n_z)
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
            part = np.empty(start[-1], dtype=np.int64)
    # Filling has moved each start to the next one.
    for cell in range(len(start) - 1, 0, -1):
        start[cell] = start[cell - 1]
    start[0] = 0
    return _Grid(low, size, (n_x, n_y, n_z), start, part)


@njit(**OPTIONS)
def _longer(array: Ints, filled: int) -> Ints:
    longer = np.empty(2 * filled + 16, dtype=np.int64)
    for i in range(filled):
        longer[i] = array[i]
    return longer


@njit(**OPTIONS)
def find_candidates(
    dim: Any,
    position: Floats,
    radius: Floats,
    skin: float,
    arrays: SurfaceArrays,
    shift: Any,
) -> Candidates:
    """Find all parts whose distance from a grain's centre is at most radius + skin.

    The list holds as long as no grain has moved by more than the skin relative to any surface.

    Parameters
    ----------
    dim : tuple of d floats
    position : (n, d or 3) float64, m
    radius : (n,) float64, m
    skin : float, m
    arrays : SurfaceArrays
    shift : tuple of d floats, m
        Displacement of the box.
    """
    vertices, shape, corner = arrays.vertices, arrays.shape, arrays.corner
    planes = arrays.planes[0]
    grains, first_facet = len(radius), len(shape)
    rows, parts = np.empty(16, dtype=np.int64), np.empty(16, dtype=np.int64)
    start = np.zeros(17, dtype=np.int64)
    m = listed = 0
    reach = skin
    for i in range(grains):
        reach = max(reach, skin + radius[i])
    sort = len(corner) > first_facet
    low, high = _bounds(dim, position) if sort else _bounds(dim, vertices)
    facet_low, facet_high = _bounds(dim, vertices)
    moved = (shift[0], shift[1], shift[2] if len(dim) == 3 else 0.0)
    low = (
        max(low[0] - moved[0], facet_low[0] - reach),
        max(low[1] - moved[1], facet_low[1] - reach),
        max(low[2] - moved[2], facet_low[2] - reach),
    )
    high = (
        min(high[0] - moved[0], facet_high[0] + reach),
        min(high[1] - moved[1], facet_high[1] + reach),
        min(high[2] - moved[2], facet_high[2] + reach),
    )
    for k in range(3):
        sort = sort and low[k] <= high[k]
    if not sort:
        low = high = (0.0, 0.0, 0.0)
    last = len(corner) if sort else first_facet
    grid = _sort_facets(dim, vertices, corner[:last], first_facet, reach, low, high)
    size, (n_x, n_y, n_z) = grid.size, grid.cells
    cell_start, cell_part = grid.start, grid.part
    height = np.empty(planes)
    for p in range(planes):
        height[p] = dot(load(dim, vertices, corner[p, 0]), load(dim, shape, p))
    for i in range(grains):
        x = plus(load(dim, position, i), -1.0, shift)
        near = radius[i] + skin
        before = listed
        cell = -1
        if sort:
            i_x = math.floor((x[0] - low[0]) / size)
            i_y = math.floor((x[1] - low[1]) / size)
            i_z = math.floor((x[2] - low[2]) / size) if len(dim) == 3 else 0
            if 0 <= i_x < n_x and 0 <= i_y < n_y and 0 <= i_z < n_z:
                cell = (int(i_x) * n_y + int(i_y)) * n_z + int(i_z)
        # most grains are near no plane
        first_part = planes
        for p in range(planes):
            if dot(x, load(dim, shape, p)) - height[p] <= near:
                first_part = 0
        sorted_first = cell_start[cell] if cell >= 0 else 0
        in_cell = cell_start[cell + 1] - sorted_first if cell >= 0 else 0
        for k in range(first_part, first_facet + in_cell):
            p = k if k < first_facet else cell_part[sorted_first + k - first_facet]
            distance = nearest(dim, vertices, planes, shape, corner, p, x, near)[0]
            if distance <= near:
                if listed == len(parts):
                    parts = _longer(parts, listed)
                parts[listed] = p
                listed += 1
        if listed > before:
            if m == len(rows):
                rows, start = _longer(rows, m), _longer(start, m + 1)
            rows[m] = i
            m += 1
            start[m] = listed
    return Candidates(rows[:m].copy(), start[: m + 1].copy(), parts[:listed].copy())
