"""Shells that pass through themselves, found by how often they go round points beside them."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from sandmould.geometry.drawing_file import MeshFileError
from sandmould.geometry.mesh import signed_volumes_m3
from sandmould.geometry.mesh_search import MeshSearch
from sandmould.geometry.mesh_shells import BESIDE, at, extent

Array = NDArray[np.float64]
Ints = NDArray[np.int64]
_PLACES = np.array([[1.0, 1.0, 1.0], [8.0, 1.0, 1.0], [1.0, 8.0, 1.0], [1.0, 1.0, 8.0]])
_SHARES = _PLACES / _PLACES.sum(axis=1, keepdims=True)
"""Of the corners of a triangle: its middle, and a place near each corner."""
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
    way = np.sign(np.bincount(shell, weights=volumes, minlength=count)).astype(np.int64)
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
        place = vertices[triangles[crosses][0]].mean(axis=0)
        raise MeshFileError(
            "a surface that does not pass through itself; about "
            f"{int(crosses.sum())} of its {len(triangles)} triangles lie where it does, {at(place)}"
        )
