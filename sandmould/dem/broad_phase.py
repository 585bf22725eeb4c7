"""Which grains may soon touch which parts of the surfaces: the global stage of section 3.6."""

from __future__ import annotations

import math
from typing import Any, NamedTuple

import numpy as np

from sandmould.arrays import Floats, Places, WholeNumbers
from sandmould.compiled import njit
from sandmould.dem.facet_grid import FacetGrid, cells_of, sort_facets
from sandmould.dem.nearest_point import nearest
from sandmould.dem.surfaces import SurfaceArrays
from sandmould.dem.vectors import OPTIONS, dot, load, plus


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
    """Put a few parts into increasing order."""
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
    dim : tuple of d floats
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
