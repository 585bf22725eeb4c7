"""Triangles between points of a plane, with some sides given."""

from __future__ import annotations

from collections.abc import Iterable

import numpy as np
from numpy.typing import NDArray
from scipy.spatial import Delaunay

Array = NDArray[np.float64]
Triangle = tuple[int, int, int]


def triangulated(point: Array, sides: Iterable[tuple[int, int]]) -> list[Triangle]:
    """Delaunay triangles of points, changed where a side that must be there crosses them.

    Anglada, Computers and Graphics 21 (1997) 215-223: the triangles that a side crosses are taken
    out, and the two polygons beside it are triangulated anew.

    Parameters
    ----------
    point : (n, 2) float64
    sides : iterable of (int, int)
        Segments that meet other segments and points at their ends only.

    Returns
    -------
    list of (int, int, int)
        Counter-clockwise; together they fill the convex hull.
    """
    simplices = Delaunay(point).simplices.tolist()
    triangles = {_counter_clockwise(point, *t) for t in simplices}
    for a, b in sides:
        if not any(a in t and b in t for t in triangles):
            _insert(point, triangles, a, b)
    return list(triangles)


def _area2(p: Array, a: int, b: int, c: int) -> float:
    """Twice the area of a triangle, positive counter-clockwise."""
    (ax, ay), (bx, by), (cx, cy) = p[a].tolist(), p[b].tolist(), p[c].tolist()
    return float((bx - ax) * (cy - ay) - (by - ay) * (cx - ax))


def _counter_clockwise(p: Array, a: int, b: int, c: int) -> Triangle:
    return (a, b, c) if _area2(p, a, b, c) > 0.0 else (a, c, b)


def _insert(p: Array, triangles: set[Triangle], a: int, b: int) -> None:
    crossed = {t for t in triangles if _crosses(p, t, a, b)}
    sides = {
        (t[k], t[(k + 1) % 3])
        for t in crossed
        for k in range(3)
        if _area2(p, a, b, t[k]) > 0.0 > _area2(p, a, b, t[(k + 1) % 3])
        and _part(p, a, b, t[k], t[(k + 1) % 3]) < 0.0
    }
    # each crossed side leads from the left of a -> b to its right, in the order of their places
    ordered = sorted(sides, key=lambda side: _place(p, a, b, *side))
    triangles -= crossed
    left = [i for k, (i, _) in enumerate(ordered) if not k or ordered[k - 1][0] != i]
    right = [j for k, (_, j) in enumerate(ordered) if not k or ordered[k - 1][1] != j]
    _fill(p, triangles, a, b, left[::-1])
    _fill(p, triangles, b, a, right)


def _part(p: Array, a: int, b: int, i: int, j: int) -> float:
    """Below 0 where the ends of a -> b lie on different sides of i -> j."""
    return _area2(p, i, j, a) * _area2(p, i, j, b)


def _place(p: Array, a: int, b: int, i: int, j: int) -> float:
    """Where i -> j crosses a -> b, from 0 to 1."""
    of_a, of_b = _area2(p, i, j, a), _area2(p, i, j, b)
    return of_a / (of_a - of_b)


def _fill(p: Array, triangles: set[Triangle], a: int, b: int, chain: list[int]) -> None:
    """Triangulate the polygon to the left of a side, whose other corners lead from b to a."""
    if not chain:
        return
    best = 0
    for k in range(1, len(chain)):
        if _in_circle(p, a, b, chain[best], chain[k]):
            best = k
    c = chain[best]
    triangles.add((a, b, c))
    _fill(p, triangles, c, b, chain[:best])
    _fill(p, triangles, a, c, chain[best + 1 :])


def _in_circle(p: Array, a: int, b: int, c: int, d: int) -> bool:
    """Whether a point lies in the circle through three, given counter-clockwise."""
    m = p[[a, b, c]] - p[d]
    rows = np.column_stack([m, (m**2).sum(axis=1)])
    return bool(np.linalg.det(rows) > 0.0)


def _crosses(p: Array, t: Triangle, a: int, b: int) -> bool:
    """Whether a segment crosses a side of a triangle."""
    side = [_area2(p, a, b, c) if c not in (a, b) else 0.0 for c in t]
    return any(
        side[k] * side[(k + 1) % 3] < 0.0 and _part(p, a, b, t[k], t[(k + 1) % 3]) < 0.0
        for k in range(3)
    )
