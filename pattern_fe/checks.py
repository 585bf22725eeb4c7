"""What keeps a mesh from being a pattern, each in one sentence."""

from __future__ import annotations

from collections.abc import Iterable
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy.sparse import coo_array
from scipy.sparse.csgraph import connected_components
from skfem.mapping import MappingIsoparametric

Array = NDArray[np.float64]
_NAMED = 5
"""Elements named in a message."""


def check_mesh(mesh: Any) -> None:
    """Refuse a mesh that is no single solid body.

    Raises
    ------
    ValueError
        When a face belongs to more than two elements, some of them are inverted or degenerate, or
        they make up several pieces. (That the outline touches itself is seen when it is built.)
    """
    if not np.isfinite(mesh.p).all():
        raise ValueError("mesh of the pattern has nodes whose coordinates are not finite")
    crowded = int((np.bincount(mesh.t2f.ravel()) > 2).sum())
    if crowded:
        raise ValueError(
            f"mesh of the pattern has {crowded} faces that belong to more than two elements, so "
            "its outline is not closed; valid is a solid whose elements meet in pairs"
        )
    bad = np.flatnonzero(_inverted(mesh))
    if len(bad):
        named = ", ".join(map(str, bad[:_NAMED])) + (", ..." if len(bad) > _NAMED else "")
        raise ValueError(
            f"mesh of the pattern has {len(bad)} inverted or degenerate elements of "
            f"{mesh.nelements} ({named}, counted from 0), valid is none"
        )
    pieces = _pieces(mesh)
    if pieces > 1:
        raise ValueError(
            f"mesh of the pattern has {pieces} pieces that share no face, valid is one "
            "(nodes at the same place must be one node)"
        )


def check_inside(place_m: Array, low_m: Array, high_m: Array, hint: str = "") -> None:
    """Refuse a pattern that reaches out of a box (ValueError).

    Parameters
    ----------
    place_m : (n, d) float64, m
        Of the pattern's nodes, or of its drawing's.
    low_m, high_m : (d,) float64, m
        Corners of the box; a pattern may touch its walls.
    hint : str, optional
        What else to say of one outside.
    """
    least, most = place_m.min(axis=0), place_m.max(axis=0)
    # seven digits of an STL file may put a face on a wall out of it
    near_m = 1e-6 * float((most - least).max())
    if (least < low_m - near_m).any() or (most > high_m + near_m).any():
        raise ValueError(
            f"pattern reaches from {place(least)} to {place(most)} m, valid is inside the box "
            f"from {place(low_m)} to {place(high_m)} m{hint}"
        )


def place(point_m: Iterable[float]) -> str:
    """Coordinates in a message."""
    return "({})".format(", ".join(f"{x:.4g}" for x in point_m))


def _inverted(mesh: Any) -> NDArray[np.bool_]:
    """Elements folded in themselves or over their neighbours, (ne,) bool."""
    # Corners may run either way: elements inside out lie on one side of a shared face.
    # not the mesh's own mapping, which inverts that of simplices at once
    mapping, axes = MappingIsoparametric(mesh, mesh.elem()), range(mesh.dim())
    edges = np.array([[mapping.J(i, j, mesh.refdom.p) for j in axes] for i in axes])
    corner_volume = np.linalg.det(edges.transpose(2, 3, 0, 1))
    extent = np.max(np.ptp(mesh.p[:, mesh.t], axis=1), axis=0) ** mesh.dim()
    least, most = corner_volume.min(axis=1), corner_volume.max(axis=1)
    folded = (least <= 1e-9 * extent) & (most >= -1e-9 * extent)
    shared = np.flatnonzero(mesh.f2t[1] >= 0)
    first_side, second_side = mesh.f2t[:, shared]
    same = _same_side(mesh, shared)
    # every element stands here once for either way it may be turned, n apart
    n = mesh.nelements
    first = np.concatenate([first_side, first_side + n])
    second = np.concatenate(
        [np.where(same, second_side + n, second_side), np.where(same, second_side, second_side + n)]
    )
    links = coo_array((np.ones(len(first)), (first, second)), shape=(2 * n, 2 * n))
    _, group = connected_components(links, directed=False)
    piece = np.minimum(group[:n], group[n:])
    turned = group[:n] != piece
    fewer = 2 * np.bincount(piece, weights=turned) <= np.bincount(piece)
    return np.asarray(folded | (turned == fewer[piece]))


def _same_side(mesh: Any, faces: NDArray[np.int64]) -> NDArray[np.bool_]:
    """Whether both elements at inner faces lie on the same side of them."""
    corners = mesh.p[:, mesh.facets[:, faces]]
    edges = corners[:, 1:] - corners[:, :1]
    if mesh.dim() == 2:
        normal = np.stack([edges[1, 0], -edges[0, 0]])
    else:
        normal = np.cross(edges[:, 0], edges[:, 1], axis=0)
    centre = mesh.p[:, mesh.t].mean(axis=1)[:, mesh.f2t[:, faces]]
    away = centre - corners.mean(axis=1)[:, None]
    side = np.sum(normal[:, None] * away, axis=0)
    return np.asarray(side[0] * side[1] >= 0.0)


def _pieces(mesh: Any) -> int:
    first, second = mesh.f2t[:, mesh.f2t[1] >= 0]
    links = coo_array((np.ones(len(first)), (first, second)), shape=(mesh.nelements,) * 2)
    return int(connected_components(links, directed=False)[0])
