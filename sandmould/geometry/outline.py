"""Closed outlines of straight edges: the solids of 2D that are no rectangles."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]


@dataclass(frozen=True)
class Outline:
    """A solid of 2D bounded by one closed line of straight edges that never meets itself."""

    name: str
    vertices_m: Array
    """(k, 2) float64, m: counter-clockwise; the last is joined to the first."""

    def distance_m(self, position_m: Array, reach_m: float = np.inf) -> Array:
        """Signed distance of points from the outline, negative inside, (n,) float64, m.

        Parameters
        ----------
        position_m : (n, 2) float64, m
        reach_m : float, m, optional
            Distances beyond it need not be exact: they are never below it, nor above the true
            ones.
        """
        start_m, end_m = self.vertices_m, np.roll(self.vertices_m, -1, axis=0)
        beyond_m = np.maximum(start_m.min(axis=0) - position_m, position_m - start_m.max(axis=0))
        distance_m = np.linalg.norm(np.maximum(beyond_m, 0.0), axis=1)
        near = distance_m <= reach_m
        distance_m[near] = _signed_m(position_m[near], (start_m, end_m), (start_m, end_m))
        return distance_m

    def corners(self) -> Array:
        """Corners of the outline, (k, 2) float64, m."""
        return self.vertices_m

    @property
    def measure(self) -> float:
        """Area, m2."""
        return signed_area_m2(self.vertices_m)


def signed_area_m2(vertices_m: Array) -> float:
    """Area of a closed polygon, positive when its vertices run counter-clockwise.

    Parameters
    ----------
    vertices_m : (k, 2) float64, m
    """
    # from the first vertex, or digits are lost far from the origin
    x, y = (vertices_m - vertices_m[0]).T
    return float(0.5 * np.sum(x * np.roll(y, -1) - np.roll(x, -1) * y))


def outline_fault(vertices_m: Array) -> str | None:
    """What keeps a list of vertices from bounding a solid, or None.

    Parameters
    ----------
    vertices_m : (k, 2) float64, m
    """
    end_m = np.roll(vertices_m, -1, axis=0)
    extent_m = float(np.ptp(vertices_m, axis=0).max())
    tiny_m = 1e-9 * extent_m
    if (np.linalg.norm(end_m - vertices_m, axis=1) <= tiny_m).any():
        return "no vertex that repeats the one before it (the last is joined to the first)"
    if _meets_itself(vertices_m, end_m):
        return "edges that neither cross nor touch one another"
    if abs(signed_area_m2(vertices_m)) <= tiny_m * extent_m:
        return "vertices that enclose an area"
    return None


def _meets_itself(start_m: Array, end_m: Array) -> bool:
    """Whether two edges meet elsewhere than at the vertex that they share."""
    k = len(start_m)
    first, second = np.triu_indices(k, 1)
    neighbours = (second - first == 1) | ((first == 0) & (second == k - 1))
    # neighbours meet in more than their vertex only when one folds back on the other
    i, j = first[neighbours], second[neighbours]
    along_i, along_j = end_m[i] - start_m[i], end_m[j] - start_m[j]
    folded = (_cross(along_i, along_j) == 0.0) & (np.sum(along_i * along_j, axis=1) < 0.0)
    i, j = first[~neighbours], second[~neighbours]
    a, b, c, d = start_m[i], end_m[i], start_m[j], end_m[j]
    sides = [_cross(b - a, c - a), _cross(b - a, d - a), _cross(d - c, a - c), _cross(d - c, b - c)]
    apart = (np.maximum(a, b) < np.minimum(c, d)) | (np.maximum(c, d) < np.minimum(a, b))
    crossing = (sides[0] * sides[1] <= 0.0) & (sides[2] * sides[3] <= 0.0) & ~apart.any(axis=1)
    return bool(folded.any() or crossing.any())


def _cross(a: Array, b: Array) -> Array:
    return np.asarray(a[..., 0] * b[..., 1] - a[..., 1] * b[..., 0])


def meridian_distance_m(point_m: Array, profile_m: Array) -> Array:
    """Signed distance in the half plane through the axis of a body of revolution.

    Edges of the profile on the axis bound nothing: the body goes on beyond them.

    Parameters
    ----------
    point_m : (n, 2) float64, m
        Place along the axis, distance from it.
    profile_m : (k, 2) float64, m
        Closed polygon of the same two coordinates.

    Returns
    -------
    (n,) float64, m
        Negative inside.
    """
    start_m, end_m = profile_m, np.roll(profile_m, -1, axis=0)
    real = (start_m[:, 1] > 0.0) | (end_m[:, 1] > 0.0)
    # the ray leads away from the axis, so edges on the axis are never met
    return _signed_m(point_m, (start_m[real], end_m[real]), (start_m, end_m))


def _signed_m(point_m: Array, near: tuple[Array, Array], round_: tuple[Array, Array]) -> Array:
    """Distance from the nearest of some edges, (n,) float64, m, negative inside others.

    Edge by edge: tables of all points and edges together leave the processor's cache.
    """
    u, v = np.ascontiguousarray(point_m.T)
    least_m2 = np.full(len(u), np.inf)
    for (start_u, start_v), (end_u, end_v) in zip(*near, strict=True):
        along_u, along_v = end_u - start_u, end_v - start_v
        from_u, from_v = u - start_u, v - start_v
        share = (from_u * along_u + from_v * along_v) / (along_u**2 + along_v**2)
        share = np.clip(share, 0.0, 1.0)
        away_u, away_v = from_u - share * along_u, from_v - share * along_v
        np.minimum(least_m2, away_u**2 + away_v**2, out=least_m2)
    inside = np.zeros(len(u), dtype=np.bool_)
    for (start_u, start_v), (end_u, end_v) in zip(*round_, strict=True):
        if start_u != end_u:
            # a ray along the second axis that meets an odd number of edges
            share = (u - start_u) / (end_u - start_u)
            above = start_v + share * (end_v - start_v) > v
            inside ^= ((start_u > u) != (end_u > u)) & above
    distance_m = np.sqrt(least_m2)
    return np.where(inside, -distance_m, distance_m)
