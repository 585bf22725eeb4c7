"""Shells that pass through themselves, found by how often they go round points beside them."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from sandmould.geometry.drawing_file import MeshFileError
from sandmould.geometry.mesh import signed_volumes_m3
from sandmould.geometry.mesh_cuts import crossings
from sandmould.geometry.mesh_search import MeshSearch
from sandmould.geometry.mesh_shells import BESIDE, SAME, at, extent

Array = NDArray[np.float64]
Ints = NDArray[np.int64]
_PLACES = np.array([[1.0, 1.0, 1.0], [8.0, 1.0, 1.0], [1.0, 8.0, 1.0], [1.0, 1.0, 8.0]])
_SHARES = _PLACES / _PLACES.sum(axis=1, keepdims=True)
"""Of the corners of a triangle: its middle, and a place near each corner."""
_ASKED = 1000
"""Triangles whose neighbours are searched for the place."""
_HELD = 2_000_000
"""Winding numbers held in memory together."""


def check_crossings(vertices: Array, triangles: Ints, shell: Ints) -> None:
    """Refuse a shell that passes through itself.

    Round a line in which a closed surface crosses itself its winding number takes three values in a
    row, so somewhere one that is neither that of inside nor that of outside.

    Parameters
    ----------
    vertices : (nv, 3) float64
    triangles : (nt, 3) int64
        Of closed shells.
    shell : (nt,) int64
        Which shell each belongs to.

    Raises
    ------
    MeshFileError
    """
    count = int(shell.max()) + 1
    volumes = signed_volumes_m3(vertices, triangles)
    # a bow tie has no volume: one of its halves is inside out, whichever way it is taken
    way = np.where(np.bincount(shell, weights=volumes, minlength=count) < 0.0, -1, 1)
    search = MeshSearch(vertices, triangles)
    crosses = np.zeros(len(triangles), dtype=np.bool_)
    off = BESIDE * extent(vertices)
    blocks = -(-len(triangles) * count // _HELD)
    for part in np.array_split(np.arange(len(triangles)), blocks):
        corners = vertices[triangles[part]]
        normal = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
        step = off * normal / np.linalg.norm(normal, axis=1, keepdims=True)
        own = shell[part]
        for share in _SHARES:
            place = np.einsum("k,tkd->td", share, corners)
            for beside in (place - step, place + step):
                around = search.windings(beside, shell)[np.arange(len(part)), own] * way[own]
                crosses[part] |= (around < 0) | (around > 1)
    if crosses.any():
        raise MeshFileError(
            "a surface that does not pass through itself; about "
            f"{int(crosses.sum())} of its {len(triangles)} triangles lie inside out or inside "
            f"where it does, {at(_place(vertices, triangles, np.flatnonzero(crosses), search))}. "
            "Part it there, or unite its parts in the program that drew it"
        )


def _place(vertices: Array, triangles: Ints, wrong: Ints, search: MeshSearch) -> Array:
    """A place where the surface passes through itself, or the middle of a wrong triangle."""
    some = wrong[:_ASKED]
    centre = vertices[triangles[some]].mean(axis=1)
    radius = np.linalg.norm(vertices[triangles[some]] - centre[:, None], axis=2).max(axis=1)
    asked, other = search.near_triangles(centre, radius)
    apart = (triangles[some[asked]][:, :, None] != triangles[other][:, None, :]).all(axis=(1, 2))
    pairs = np.stack([some[asked], other], axis=1)[apart]
    found = crossings(vertices, triangles, pairs, SAME * extent(vertices))
    return np.concatenate([found, centre])[0]
