"""Drawings of very many triangles made coarser, as far as nobody can see."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from sandmould.geometry.drawing_file import MeshFileError
from sandmould.geometry.mesh import TriangleMesh
from sandmould.geometry.mesh_crossing import check_crossings
from sandmould.geometry.mesh_shells import extent, joined_sides, with_own_vertices

Array = NDArray[np.float64]
Ints = NDArray[np.int64]
MANY = 10_000
"""Triangles up to which a drawing stays as it is."""
WITHIN = 1e-3
"""Share of the extent by which the coarser surface may lie off, 0.1 mm of 100 mm."""
MEASURE_WITHIN = 1e-3
"""Share by which its volume and its area may differ."""
_LEAST_SINE = 0.002
"""Of the angles of triangles, or the least drawn one: LIGGGHTS refuses half of it."""
_CAREFUL = (1.0, 3.0, 7.0)
"""How far the library goes in a round, careful first: on a sphere no edge costs nothing."""


def coarser(drawn: TriangleMesh) -> TriangleMesh:
    """A closed surface of few triangles in the place of one of many, if there is such a one.

    Their number is halved until it is below ``MANY``, or less often where that leaves the place.
    """
    import fast_simplification  # few drawings need it

    number = len(drawn.triangles)
    for halvings in range(int(np.ceil(np.log2(number / MANY))), 0, -1):
        for careful in _CAREFUL:
            target = number // 2**halvings
            places, cells = fast_simplification.simplify(
                drawn.vertices_m, drawn.triangles, target_count=target, agg=careful
            )
            cells = cells.astype(np.int64)
            if len(cells) <= 1.5 * target and _is_as(drawn, places, cells):
                own = with_own_vertices(places, cells, joined_sides(places, cells))
                return TriangleMesh(drawn.name, *own)
    return drawn


def without_slivers(drawn: TriangleMesh) -> TriangleMesh:
    """A closed surface without the triangles that a flat face does not need."""
    import fast_simplification

    places, cells = fast_simplification.simplify(
        drawn.vertices_m, drawn.triangles, target_reduction=0.9, lossless=True
    )
    cells = cells.astype(np.int64)
    return TriangleMesh(drawn.name, places, cells) if _is_as(drawn, places, cells) else drawn


def _is_as(drawn: TriangleMesh, places: Array, cells: Ints) -> bool:
    """Whether a surface is closed, of good triangles and nowhere too far from the drawn one."""
    mesh = TriangleMesh("coarser", places, cells)
    least = min(_LEAST_SINE, _shapes(drawn.corners_m)[1].min())
    off = abs(mesh.measure / drawn.measure - 1.0), abs(mesh.surface_m2 / drawn.surface_m2 - 1.0)
    if max(off) > MEASURE_WITHIN or _shapes(mesh.corners_m)[1].min() < least:
        return False
    near = WITHIN * extent(drawn.vertices_m)
    if np.abs(drawn.distance_m(_sampled(mesh))).max() > near:
        return False
    if np.abs(mesh.distance_m(_sampled(drawn))).max() > near:
        return False
    try:
        joined_sides(places, cells, most=2)
        check_crossings(places, cells, np.zeros(len(cells), dtype=np.int64))
    except MeshFileError:
        return False
    return True


def _shapes(corners: Array) -> tuple[Array, Array]:
    """Unit normals of triangles, (n, 3), and the sine of the least angle of each, (n,)."""
    a, b, c = corners.transpose(1, 0, 2)
    normal = np.cross(b - a, c - a)
    area2 = np.linalg.norm(normal, axis=1)
    sides = np.sort([np.linalg.norm(e, axis=1) for e in (b - a, c - b, a - c)], axis=0)
    safe = np.where(area2 > 0.0, area2, 1.0)
    return normal / safe[:, None], area2 / np.maximum(sides[1] * sides[2], 1e-300)


def _sampled(mesh: TriangleMesh) -> Array:
    """Vertices of a mesh and the middles of its triangles."""
    return np.concatenate([mesh.vertices_m, mesh.corners_m.mean(axis=1)])
