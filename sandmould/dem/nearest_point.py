"""The point of one part of a surface that lies nearest to a grain's centre."""

from __future__ import annotations

import math
from typing import Any

from sandmould.arrays import Floats, Ints
from sandmould.compiled import njit
from sandmould.dem.vectors import INLINED, dot, load, plus, times

FAR = math.inf
"""Distance of whatever lies out of reach."""


@njit(**INLINED)
def _on_segment(
    start_x: float, start_y: float, end_x: float, end_y: float, x: float, y: float, reach: float
) -> Any:
    """Nearest point of a segment: distance or ``FAR``, unit vector, share, whether inside."""
    along_x, along_y = end_x - start_x, end_y - start_y
    length2 = along_x * along_x + along_y * along_y
    from_x, from_y = x - start_x, y - start_y
    across = along_x * from_y - along_y * from_x
    if across * across > reach * reach * length2:
        return FAR, 0.0, 0.0, 0.0, False
    share = (from_x * along_x + from_y * along_y) / length2
    length = math.sqrt(length2)
    side = -1.0 if across >= 0.0 else 1.0
    n_x, n_y = -side * along_y / length, side * along_x / length
    if 0.0 < share < 1.0:
        return abs(across) / length, n_x, n_y, share, True
    share = 0.0 if share <= 0.0 else 1.0
    to_x, to_y = share * along_x - from_x, share * along_y - from_y
    distance = math.sqrt(to_x * to_x + to_y * to_y)
    if distance > 0.0:
        n_x, n_y = to_x / distance, to_y / distance
    return distance, n_x, n_y, share, False


@njit(**INLINED)
def _share(numerator: float, denominator: float) -> float:
    return numerator / denominator if denominator > 0.0 else 0.0


@njit(**INLINED)
def _on_triangle(a: Any, b: Any, c: Any, x: Any, reach: float) -> Any:
    """Nearest point of a triangle: distance or ``FAR``, unit vector, weights, whether inside."""
    # By the regions of its corners and edges: Ericson, Real-Time Collision Detection (2005), 5.1.5.
    ab, ac, ax = plus(b, -1.0, a), plus(c, -1.0, a), plus(x, -1.0, a)
    normal = (
        ab[1] * ac[2] - ab[2] * ac[1],
        ab[2] * ac[0] - ab[0] * ac[2],
        ab[0] * ac[1] - ab[1] * ac[0],
    )
    size2 = dot(normal, normal)
    height = dot(normal, ax)
    if height * height > reach * reach * size2:
        return FAR, normal, normal, False
    size = math.sqrt(size2)
    n = times(normal, (-1.0 if height >= 0.0 else 1.0) / size)
    d1, d2 = dot(ab, ax), dot(ac, ax)
    bx, cx = plus(x, -1.0, b), plus(x, -1.0, c)
    d3, d4 = dot(ab, bx), dot(ac, bx)
    d5, d6 = dot(ab, cx), dot(ac, cx)
    va, vb, vc = d3 * d6 - d5 * d4, d5 * d2 - d1 * d6, d1 * d4 - d3 * d2
    if d1 <= 0.0 and d2 <= 0.0:
        weights = (1.0, 0.0, 0.0)
    elif d3 >= 0.0 and d4 <= d3:
        weights = (0.0, 1.0, 0.0)
    elif d6 >= 0.0 and d5 <= d6:
        weights = (0.0, 0.0, 1.0)
    elif vc <= 0.0 and d1 >= 0.0 and d3 <= 0.0:
        t = _share(d1, d1 - d3)
        weights = (1.0 - t, t, 0.0)
    elif vb <= 0.0 and d2 >= 0.0 and d6 <= 0.0:
        t = _share(d2, d2 - d6)
        weights = (1.0 - t, 0.0, t)
    elif va <= 0.0 and d4 >= d3 and d5 >= d6:
        t = _share(d4 - d3, (d4 - d3) + (d5 - d6))
        weights = (0.0, 1.0 - t, t)
    else:
        total = va + vb + vc
        return abs(height) / size, n, (va / total, vb / total, vc / total), True
    to = plus(plus(plus(times(a, weights[0]), weights[1], b), weights[2], c), -1.0, x)
    distance = math.sqrt(dot(to, to))
    return distance, times(to, 1.0 / distance) if distance > 0.0 else n, weights, False


@njit(**INLINED)
def _across(axis: Any) -> Any:
    """Give some unit vector across an axis."""
    if abs(axis[0]) < 0.6:
        v = plus((1.0, 0.0, 0.0), -axis[0], axis)
    else:
        v = plus((0.0, 1.0, 0.0), -axis[1], axis)
    return times(v, 1.0 / math.sqrt(dot(v, v)))


@njit(**INLINED)
def _on_revolved(axis: Any, line: Any, origin: Any, x: Any, reach: float) -> Any:
    """Nearest point of one line of a profile of revolution, in the centre's meridian plane."""
    from_origin = plus(x, -1.0, origin)
    axial = dot(from_origin, axis)
    outward = plus(from_origin, -axial, axis)
    radial = math.sqrt(dot(outward, outward))
    distance, n_a, n_r, _, inside = _on_segment(
        line[0], line[1], line[2], line[3], axial, radial, reach
    )
    outward = times(outward, 1.0 / radial) if radial > 0.0 else _across(axis)
    return distance, plus(times(axis, n_a), n_r, outward), inside


@njit(**INLINED)
def nearest(
    dim: Any,
    vertices: Floats,
    planes: int,
    shape: Floats,
    corner: Ints,
    part: int,
    x: Any,
    reach: float,
) -> Any:
    """Nearest point of a part.

    Parameters
    ----------
    vertices, planes, shape, corner
        Of the ``SurfaceArrays``: a tuple of arrays costs more than its arrays.
    x : tuple of d floats, m
        A grain's centre in the frame of the box.
    reach : float, m

    Returns
    -------
    distance : float, m
        Negative behind a plane, ``FAR`` where the part lies out of reach; it may be given beyond
        the reach too.
    n : tuple of d floats
        Unit vector from the centre to the nearest point, or, behind a plane, away from it.
    weights : tuple of d floats
        Shape functions H of the part's corners at the point, eq. (56).
    inside : bool
        Whether the point lies inside the part, and not on an edge or a corner of it.
    """
    a = load(dim, vertices, corner[part, 0])
    if len(dim) == 2:
        if part < planes:
            normal = load(dim, shape, part)
            return dot(plus(x, -1.0, a), normal), times(normal, -1.0), (1.0, 0.0), True
        b = load(dim, vertices, corner[part, 1])
        distance, n_x, n_y, share, inside = _on_segment(a[0], a[1], b[0], b[1], x[0], x[1], reach)
        return distance, (n_x, n_y), (1.0 - share, share), inside
    if part < planes:
        normal = load(dim, shape, part)
        return dot(plus(x, -1.0, a), normal), times(normal, -1.0), (1.0, 0.0, 0.0), True
    if part < len(shape):
        line = (shape[part, 3], shape[part, 4], shape[part, 5], shape[part, 6])
        distance, n, inside = _on_revolved(load(dim, shape, part), line, a, x, reach)
        return distance, n, (1.0, 0.0, 0.0), inside
    b, c = load(dim, vertices, corner[part, 1]), load(dim, vertices, corner[part, 2])
    return _on_triangle(a, b, c, x, reach)
