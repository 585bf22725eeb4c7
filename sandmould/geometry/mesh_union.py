"""The surface of what several shells hold together.

Shells are cut where they meet, and of the pieces those stay that have the solid on one side alone:
where the winding number of all shells is above 1/2 behind them and below it in front. What lies
inside the union is gone, so that neither grains nor volumes meet it.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray
from scipy.sparse import coo_array
from scipy.sparse.csgraph import connected_components

from sandmould.geometry.drawing_file import MeshFileError
from sandmould.geometry.mesh import TriangleMesh
from sandmould.geometry.mesh_coarser import without_slivers
from sandmould.geometry.mesh_cuts import CutShells, cut
from sandmould.geometry.mesh_search import MeshSearch
from sandmould.geometry.mesh_shells import (
    BESIDE,
    SAME,
    extent,
    joined_sides,
    meeting_sides,
    sides_of,
    with_own_vertices,
)

Array = NDArray[np.float64]
Ints = NDArray[np.int64]

NEAR = (SAME, 4.0 * SAME, 16.0 * SAME, 64.0 * SAME)
"""Shares of the extent below which points of different shells are one. Faces that meet at a small
angle cross at places that rounding of the file moves by many times its own size, so that wider
ones are tried where the first leave the union open."""

_BLOCK = 5000
"""Places asked together."""


def united(vertices: Array, triangles: Ints, shell: Ints) -> tuple[Array, Ints]:
    """Surface of the union of shells.

    Parameters
    ----------
    vertices : (nv, 3) float64
    triangles : (nt, 3) int64
        Each shell faces outwards; a cavity inwards.
    shell : (nt,) int64
        Which shell each belongs to.

    Returns
    -------
    vertices : (mv, 3) float64
    triangles : (mt, 3) int64
        Closed, and seen from outside.

    Raises
    ------
    MeshFileError
        When shells meet so nearly that their union cannot be told.
    """
    size = extent(vertices)
    search = MeshSearch(vertices, triangles)
    for near in NEAR:
        pieces = cut(vertices, triangles, shell, near * size)
        stays = _bounds(pieces, search, shell, max(BESIDE, 4.0 * near) * size)
        kept = pieces.triangles[stays]
        try:
            joined = joined_sides(pieces.vertices, kept)
        except MeshFileError as fault:
            problem = fault
        else:
            whole = TriangleMesh("union", *with_own_vertices(pieces.vertices, kept, joined))
            plain = without_slivers(whole)  # LIGGGHTS refuses the narrow ones along a cut
            return plain.vertices_m, plain.triangles
    where = "one at" + str(problem).rsplit("one at", 1)[-1]
    valid = "shells that overlap or touch clearly, or lie apart"
    raise MeshFileError(f"{valid}; their union leaves open edges, {where}")


def _bounds(pieces: CutShells, search: MeshSearch, shell: Ints, beside: float) -> NDArray[np.bool_]:
    """Which pieces bound the union.

    Pieces that an edge of no other piece parts are of one kind: their largest is asked.
    """
    patch = _patches(pieces.triangles)
    corners = pieces.vertices[pieces.triangles]
    normal = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    area = np.linalg.norm(normal, axis=1)
    order = np.lexsort((-area, patch))
    asked = order[np.unique(patch[order], return_index=True)[1]]
    off = beside * normal[asked] / area[asked, None]
    place = corners[asked].mean(axis=1)
    bounds = np.empty(len(asked), dtype=np.bool_)
    # a block of places at a time: each is asked of every shell
    for part in np.array_split(np.arange(len(asked)), -(-len(asked) // _BLOCK)):
        before = search.windings((place + off)[part], shell)
        behind = search.windings((place - off)[part], shell)
        bounds[part] = (before.sum(axis=1) <= 0) & (behind.sum(axis=1) > 0)
        # where several shells have one face, the first of them keeps it
        bounds[part] &= (behind > before).argmax(axis=1) == pieces.shell[asked[part]]
    return np.asarray(bounds[patch])


def _patches(triangles: Ints) -> Ints:
    """Number of the patch of each triangle: joined over edges of two triangles."""
    a, b = (meeting_sides(sides_of(triangles)) // 3).T
    n = len(triangles)
    links = coo_array((np.ones(len(a)), (a, b)), shape=(n, n))
    return np.asarray(connected_components(links, directed=False)[1], dtype=np.int64)
