"""Outlines of solids in the vertical plane that pictures show."""

from __future__ import annotations

import numpy as np

from sandmould.geometry.geometry import Array, Block, Solid
from sandmould.geometry.mesh import TriangleMesh
from sandmould.geometry.outline import Outline, signed_area_m2


def solid_sections(solid: Solid, cut_m: float) -> list[Array]:
    """Polygons in which the plane shown cuts a solid, (k, 2) float64, m.

    ``cut_m``, float, m: in 3D, y of the plane of x and z; of no meaning in 2D.

    A hole is joined to the polygon round it by an edge there and back.
    """
    if isinstance(solid, Outline):
        return [solid.vertices_m]
    if isinstance(solid, Block):
        hull_m = convex_section(solid.corners(), cut_m)
        return [hull_m] if len(hull_m) else []
    mesh = solid if isinstance(solid, TriangleMesh) else solid.mesh()
    return _with_holes(mesh.section_m(1, cut_m))


def convex_section(corners_m: Array, cut_m: float) -> Array:
    """Polygon in which the plane shown cuts a convex body, (k, 2) float64, m.

    ``corners_m``: (m, d) float64, m.

    Empty where the plane misses the body.
    """
    points_m = corners_m
    if corners_m.shape[1] == 3:
        # every line between two corners lies inside the body, so its section is their hull
        first, second = np.triu_indices(len(corners_m), 1)
        a, b = corners_m[first], corners_m[second]
        crossed = (a[:, 1] - cut_m) * (b[:, 1] - cut_m) <= 0.0
        crossed &= a[:, 1] != b[:, 1]
        a, b = a[crossed], b[crossed]
        step = (cut_m - a[:, 1]) / (b[:, 1] - a[:, 1])
        points_m = (a + step[:, None] * (b - a))[:, [0, 2]]
    if len(points_m) < 3:
        return np.zeros((0, 2))
    from scipy.spatial import ConvexHull, QhullError  # a third of a second

    try:
        return points_m[ConvexHull(points_m).vertices]
    except QhullError:
        return np.zeros((0, 2))


def _with_holes(loops_m: list[Array]) -> list[Array]:
    """Join each hole to the smallest polygon round it; holes run against their solid's rim."""
    areas = [signed_area_m2(loop) for loop in loops_m]
    way = np.sign(max(areas, key=abs, default=0.0))
    rims = sorted((i for i, a in enumerate(areas) if a * way > 0.0), key=lambda i: abs(areas[i]))
    joined = {i: loops_m[i] for i in rims}
    for hole, area in zip(loops_m, areas, strict=True):
        if area * way >= 0.0:
            continue
        # a shell that touches the plane from one side leaves loops without a rim round them
        around = [i for i in rims if Outline("", loops_m[i]).distance_m(hole[:1])[0] < 0.0]
        if around:
            joined[around[0]] = _bridged(joined[around[0]], hole)
    return list(joined.values())


def _bridged(rim_m: Array, hole_m: Array) -> Array:
    """One polygon round a rim, over the shortest bridge to a hole, round it and back."""
    apart = np.linalg.norm(rim_m[:, None] - hole_m, axis=2)
    i, j = np.unravel_index(int(np.argmin(apart)), apart.shape)
    hole_m = np.roll(hole_m, -int(j), axis=0)
    return np.concatenate([rim_m[: i + 1], hole_m, hole_m[:1], rim_m[i:]])
