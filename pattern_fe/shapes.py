"""Meshes of patterns made of rectangles: quadrilaterals in 2D, extruded to hexahedra in 3D."""

from __future__ import annotations

import itertools
import math
from collections.abc import Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray
from skfem import MeshHex, MeshQuad

Array = NDArray[np.float64]
Rectangle = tuple[float, float, float, float]
"""Left, bottom, right, top, m."""
SIDES = {
    2: (("left", "right"), ("bottom", "top")),
    3: (("left", "right"), ("front", "back"), ("bottom", "top")),
}
"""Names of the extreme sides along each axis; the last axis is the vertical one."""


def bar(width_m: float, height_m: float) -> list[Rectangle]:
    """Single rectangle with its lower left corner at the origin."""
    return [(0.0, 0.0, width_m, height_m)]


def l_shape(thickness_m: float, height_m: float, reach_m: float) -> list[Rectangle]:
    """Stem with a horizontal flange at its top, as the pattern of Rojek (2004), figure 17.

    ``thickness_m``: of stem and flange. ``height_m``: from the foot to the top of the flange.
    ``reach_m``: from the back of the stem to the tip of the flange.
    """
    return [(0.0, 0.0, thickness_m, height_m), (0.0, height_m - thickness_m, reach_m, height_m)]


def mesh_of(rectangles: Sequence[Rectangle], element_m: float, depth_m: float | None = None) -> Any:
    """Mesh a union of rectangles that overlap or share sides, with the sides of ``SIDES`` named.

    All corners lie on grid lines, and between two of these elements are equally long, no longer
    than asked: ``thickness_m / n`` gives n elements through a thickness.

    Parameters
    ----------
    rectangles : sequence of (left, bottom, right, top), m
    element_m : float, m
        Longest side of an element.
    depth_m : float, m, optional
        Extrudes the shape along the second of three axes.

    Raises
    ------
    ValueError
        When the element size or a rectangle has no extent.
    """
    if not (math.isfinite(element_m) and element_m > 0.0):
        raise ValueError(f"element size of the pattern is {element_m:g} m, valid is above 0")
    parts = np.array(rectangles, dtype=np.float64).reshape(-1, 2, 2)
    if depth_m is not None:
        span = np.broadcast_to([[0.0], [depth_m]], (len(parts), 2, 1))
        parts = np.concatenate([parts[:, :, :1], span, parts[:, :, 1:]], axis=2)
    low, high = parts[:, 0], parts[:, 1]
    if not (len(parts) and np.isfinite(parts).all() and (high > low).all()):
        raise ValueError(f"rectangles {list(rectangles)} need a positive width, height and depth")
    lines = [_grid_line(parts[:, :, axis], element_m) for axis in range(low.shape[1])]
    grid = (MeshQuad if depth_m is None else MeshHex).init_tensor(*lines)
    centre = grid.p[:, grid.t].mean(axis=1).T[:, None]
    inside = ((centre > low) & (centre < high)).all(axis=2).any(axis=1)
    return with_sides(grid.restrict(np.flatnonzero(inside)))


def _grid_line(places_m: Array, element_m: float) -> Array:
    """Places along one axis with all sides of the rectangles among them."""
    ends = np.unique(places_m)
    # sums of the user's lengths may miss one another by round-off
    ends = ends[np.concatenate([[True], np.diff(ends) > 1e-9 * (ends[-1] - ends[0])])]
    pieces = [
        np.linspace(a, b, 1 + max(1, math.ceil((b - a) / element_m - 1e-9)))[:-1]
        for a, b in itertools.pairwise(ends)
    ]
    return np.concatenate([*pieces, ends[-1:]])


def with_sides(mesh: Any) -> Any:
    """Name the boundary at either end of each axis; names the mesh already has are kept."""
    low, high = mesh.p.min(axis=1), mesh.p.max(axis=1)
    near_m = 1e-9 * float((high - low).max())
    named = mesh.boundaries or {}
    sides = {
        name: mesh.facets_satisfying(
            lambda x, axis=axis, place=place: np.abs(x[axis] - place) <= near_m, True
        )
        for axis, names in enumerate(SIDES[mesh.dim()])
        for name, place in zip(names, (low[axis], high[axis]), strict=True)
    }
    return mesh.with_boundaries(
        {name: facets for name, facets in sides.items() if name not in named and len(facets)}
    )


def name_of(boundary: str, body: int) -> str:
    """Name of a boundary of one of several bodies, counted from 0; the first keep theirs."""
    return f"{boundary} of pattern.others.{body - 1}" if body else boundary


def side_by_side(meshes: Sequence[Any]) -> Any:
    """Bodies that share nothing as one mesh, with their boundaries.

    Raises
    ------
    ValueError
        When they are not made of the same elements.
    """
    first, *others = meshes
    if not others:
        return first
    unlike = {type(mesh).__name__ for mesh in others} - {type(first).__name__}
    if unlike:
        valid = f"the elements of the first one, {type(first).__name__}"
        raise ValueError(f"it has a {unlike.pop()}; in one box valid are {valid}")
    corners = np.cumsum([0, *(mesh.nvertices for mesh in meshes)])
    # faces are numbered by their corners, so those of one body come after those of another
    faces = np.cumsum([0, *(mesh.nfacets for mesh in meshes)])
    whole = type(first)(
        np.hstack([mesh.p for mesh in meshes]),
        np.hstack([mesh.t + start for mesh, start in zip(meshes, corners[:-1], strict=True)]),
    )
    return whole.with_boundaries(
        {
            name_of(name, number): np.asarray(of_body) + faces[number]
            for number, mesh in enumerate(meshes)
            for name, of_body in mesh.boundaries.items()
        }
    )
