"""Hollows of a part: what its convex hull holds and the part does not."""

from __future__ import annotations

from dataclasses import replace
from functools import lru_cache

import numpy as np
from numpy.typing import NDArray
from scipy.spatial import ConvexHull

from sandmould.bad_input import BadInputError, Problem
from sandmould.geometry.drawing_file import MeshFileError
from sandmould.geometry.mesh import TriangleMesh
from sandmould.geometry.mesh_shells import SAME, extent, joined_sides, shells_of
from sandmould.geometry.mesh_union import united

Array = NDArray[np.float64]
Ints = NDArray[np.int64]
LEAST = 1e-4
"""Share of the hull's volume below which a hollow is one between facets of a round part."""


def hollows(vertices: Array, triangles: Ints) -> list[TriangleMesh]:
    """Spaces that a closed surface leaves free in its convex hull, the largest first.

    ``vertices``: (nv, 3) float64. ``triangles``, (nt, 3) int64: seen from outside.

    Raises
    ------
    MeshFileError
        When part and hull meet so nearly that what lies between cannot be told.
    """
    hull = ConvexHull(vertices)
    if hull.volume - TriangleMesh("part", vertices, triangles).measure <= LEAST * hull.volume:
        return []
    outward = hull.simplices.astype(np.int64)
    corners = vertices[outward]
    normal = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    inward = np.sum(normal * hull.equations[:, :3], axis=1) < 0.0
    outward[inward] = outward[inward, ::-1]
    wide = np.linalg.norm(normal, axis=1) > SAME**2 * extent(vertices) ** 2
    both = np.concatenate([outward[wide], triangles[:, ::-1]])
    shell = np.repeat([0, 1], [wide.sum(), len(triangles)])
    place, left = united(vertices, both, shell)
    piece = shells_of(joined_sides(place, left), len(left))
    found = [TriangleMesh("hollow", place, left[piece == n]) for n in range(piece.max() + 1)]
    found = [it for it in found if it.measure > LEAST * hull.volume]
    return sorted(found, key=lambda it: -it.measure)


@lru_cache(maxsize=8)
def _found(vertices: bytes, triangles: bytes) -> list[TriangleMesh]:
    """The same of the bytes of its arrays, found once for all points of a sweep."""
    return hollows(
        np.frombuffer(vertices).reshape(-1, 3), np.frombuffer(triangles, np.int64).reshape(-1, 3)
    )


def hollow_of(part: TriangleMesh, number: int, key: str) -> TriangleMesh:
    """A hollow of a part under its name, counted from 1, the largest.

    Raises
    ------
    BadInputError
        When the part has fewer, or they cannot be told.
    """
    try:
        found = _found(part.vertices_m.tobytes(), part.triangles.tobytes())
    except MeshFileError as fault:
        raise BadInputError([Problem(f"{key}.hollow", number, str(fault))]) from fault
    if number > len(found):
        sizes = ", ".join(f"{1e6 * it.measure:.4g}" for it in found)
        valid = f"1 to {len(found)}: the hollows of this part hold {sizes} cm3"
        if not found:
            valid = "absent: this part is convex and has no hollow"
        raise BadInputError([Problem(f"{key}.hollow", number, valid)])
    return replace(found[number - 1], name=part.name)
