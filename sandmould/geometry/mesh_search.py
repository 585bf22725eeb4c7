"""Nearest triangles of a mesh, found in a tree of boxes by compiled code.

The sign of a distance comes from angle-weighted pseudonormals (Baerentzen and Aanaes, IEEE
Transactions on Visualization and Computer Graphics 11, 2005): where the nearest point lies on an
edge or a vertex, the normal of one triangle alone can have the wrong sign.
"""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from sandmould.compiled import njit
from sandmould.geometry.mesh_winding import LEAF, windings

Array = NDArray[np.float64]
_DEPTH = 40
"""Boxes that a walk through the tree can have before it: more than the tree has levels."""


class MeshSearch:
    """The triangles of a mesh in a tree of boxes, with the pseudonormals of all their parts."""

    def __init__(self, vertices_m: Array, triangles: NDArray[np.int64]) -> None:
        """Build the tree.

        Parameters
        ----------
        vertices_m : (nv, 3) float64, m
        triangles : (nt, 3) int64
            A closed surface; counter-clockwise seen from outside.
        """
        corners_m = vertices_m[triangles]
        order = _along_a_curve(corners_m.mean(axis=1))
        self._original = order
        self._corners_m = np.ascontiguousarray(corners_m[order])
        self._normals = np.ascontiguousarray(_pseudonormals(vertices_m, triangles)[order])
        self._low_m, self._high_m = _boxes(self._corners_m)

    def distance_m(self, position_m: Array, reach_m: float) -> Array:
        """See :meth:`sandmould.geometry.mesh.TriangleMesh.distance_m`."""
        point_m = np.ascontiguousarray(position_m, dtype=np.float64)
        return _distances(
            point_m, reach_m, self._corners_m, self._normals, self._low_m, self._high_m
        )

    def windings(self, position_m: Array, shell: NDArray[np.int64]) -> NDArray[np.int64]:
        """How often each shell goes round each point.

        Parameters
        ----------
        position_m : (n, 3) float64, m
        shell : (nt,) int64
            Number of the shell of each triangle, from 0.

        Returns
        -------
        (n, shells) int64
            1 inside a shell whose triangles run counter-clockwise seen from outside, -1 inside
            one that faces inwards.
        """
        point_m = np.ascontiguousarray(position_m, dtype=np.float64)
        count = int(shell.max()) + 1
        tree = (self._low_m, self._high_m)
        return windings(point_m, self._corners_m, shell[self._original], count, *tree)

    def near_triangles(
        self, position_m: Array, radius_m: Array
    ) -> tuple[NDArray[np.int64], NDArray[np.int64]]:
        """See :meth:`sandmould.geometry.mesh.TriangleMesh.near_triangles`."""
        point_m = np.ascontiguousarray(position_m, dtype=np.float64)
        radius_m = np.ascontiguousarray(radius_m, dtype=np.float64)
        nothing = np.empty(0, dtype=np.int64)
        tree = (self._corners_m, self._low_m, self._high_m)
        count = _near(point_m, radius_m, *tree, nothing, nothing)
        sphere, triangle = np.empty(count, dtype=np.int64), np.empty(count, dtype=np.int64)
        _near(point_m, radius_m, *tree, sphere, triangle)
        return sphere, self._original[triangle]


def _along_a_curve(place_m: Array) -> NDArray[np.int64]:
    """Order of places along a curve that fills space (Morton's): neighbours stay near."""
    low_m = place_m.min(axis=0)
    extent_m = float((place_m - low_m).max()) or 1.0
    cell = ((place_m - low_m) / extent_m * 1023).astype(np.int64)
    code = np.zeros(len(place_m), dtype=np.int64)
    for bit in range(10):
        for axis in range(3):
            code |= ((cell[:, axis] >> bit) & 1) << (3 * bit + axis)
    return np.argsort(code, kind="stable")


def _boxes(corners_m: Array) -> tuple[Array, Array]:
    """Boxes of a binary tree: node 0 is the root, 2 i + 1 and 2 i + 2 lie below i.

    The last half of the nodes are leaves of four triangles in order; those without any are empty,
    infinitely far away.
    """
    leaves = 1 << max(0, math.ceil(math.log2(max(1, -(-len(corners_m) // LEAF)))))
    low_m, high_m = np.full((2 * leaves - 1, 3), np.inf), np.full((2 * leaves - 1, 3), np.inf)
    starts = np.arange(0, len(corners_m), LEAF)
    at = leaves - 1 + np.arange(len(starts))
    low_m[at] = np.minimum.reduceat(corners_m.min(axis=1), starts)
    high_m[at] = np.maximum.reduceat(corners_m.max(axis=1), starts)
    while leaves > 1:
        leaves //= 2
        own = np.arange(leaves - 1, 2 * leaves - 1)
        left, right = 2 * own + 1, 2 * own + 2
        low_m[own] = np.minimum(low_m[left], low_m[right])
        empty = ~np.isfinite(low_m[right, 0])
        above = np.maximum(high_m[left], high_m[right])
        high_m[own] = np.where(empty[:, None], high_m[left], above)
    return low_m, high_m


def _pseudonormals(vertices_m: Array, triangles: NDArray[np.int64]) -> Array:
    """Normals of each triangle's face, edges 01, 12, 20 and vertices 0, 1, 2, (nt, 7, 3)."""
    corners_m = vertices_m[triangles]
    edge_m = np.roll(corners_m, -1, axis=1) - corners_m
    face = np.cross(edge_m[:, 0], edge_m[:, 1])
    face /= np.linalg.norm(face, axis=1)[:, None]
    along = edge_m / np.linalg.norm(edge_m, axis=2)[..., None]
    back = -np.roll(along, 1, axis=1)
    angle = np.arctan2(np.linalg.norm(np.cross(along, back), axis=2), np.sum(along * back, axis=2))
    at_vertex = np.zeros_like(vertices_m)
    np.add.at(at_vertex, triangles.ravel(), (angle[..., None] * face[:, None]).reshape(-1, 3))
    after = np.roll(triangles, -1, axis=1)
    low, high = np.minimum(triangles, after), np.maximum(triangles, after)
    # one number an edge: far quicker to sort than two
    _, edge = np.unique(low * len(vertices_m) + high, return_inverse=True)
    at_edge = np.zeros((edge.max() + 1, 3))
    np.add.at(at_edge, edge.ravel(), np.repeat(face, 3, axis=0))
    normals = [face[:, None], at_edge[edge.reshape(-1, 3)], at_vertex[triangles]]
    return np.concatenate(normals, axis=1)


@njit()
def _box_gap2(p, low, high):  # type: ignore[no-untyped-def]
    """Squared distance of a point from a box, 0 inside."""
    gap2 = 0.0
    for i in range(3):
        away = max(low[i] - p[i], p[i] - high[i], 0.0)
        gap2 += away * away
    return gap2


@njit()
def _nearest_on_triangle(p, t, nearest):  # type: ignore[no-untyped-def]
    """Nearest point of a triangle (Ericson, Real-Time Collision Detection, 5.1.5).

    Returns its part: 0 face; 1, 2, 3 edges 01, 12, 20; 4, 5, 6 vertices.
    """
    d1 = d2 = d3 = d4 = d5 = d6 = 0.0
    for i in range(3):
        ab, ac = t[1, i] - t[0, i], t[2, i] - t[0, i]
        d1 += ab * (p[i] - t[0, i])
        d2 += ac * (p[i] - t[0, i])
        d3 += ab * (p[i] - t[1, i])
        d4 += ac * (p[i] - t[1, i])
        d5 += ab * (p[i] - t[2, i])
        d6 += ac * (p[i] - t[2, i])
    vc, vb, va = d1 * d4 - d3 * d2, d5 * d2 - d1 * d6, d3 * d6 - d5 * d4
    if d1 <= 0.0 and d2 <= 0.0:
        part, v, w = 4, 0.0, 0.0
    elif d3 >= 0.0 and d4 <= d3:
        part, v, w = 5, 1.0, 0.0
    elif d6 >= 0.0 and d5 <= d6:
        part, v, w = 6, 0.0, 1.0
    elif vc <= 0.0 and d1 >= 0.0 and d3 <= 0.0:
        part, v, w = 1, d1 / (d1 - d3), 0.0
    elif vb <= 0.0 and d2 >= 0.0 and d6 <= 0.0:
        part, v, w = 3, 0.0, d2 / (d2 - d6)
    elif va <= 0.0 and d4 >= d3 and d5 >= d6:
        w = (d4 - d3) / ((d4 - d3) + (d5 - d6))
        part, v = 2, 1.0 - w
    else:
        part, v, w = 0, vb / (va + vb + vc), vc / (va + vb + vc)
    for i in range(3):
        nearest[i] = t[0, i] + v * (t[1, i] - t[0, i]) + w * (t[2, i] - t[0, i])
    return part


@njit()
def _distances(points, reach, corners, normals, low, high):  # type: ignore[no-untyped-def]
    """Signed distance of each point; that of the root's box where it is beyond the reach."""
    leaves = (len(low) + 1) // 2
    distance = np.empty(len(points))
    nodes, gaps = np.empty(_DEPTH, np.int64), np.empty(_DEPTH)
    here, best = np.empty(3), np.empty(3)
    for n in range(len(points)):
        p = points[n]
        gap2 = _box_gap2(p, low[0], high[0])
        if gap2 > reach * reach:
            distance[n] = math.sqrt(gap2)
            continue
        best2, triangle, part = np.inf, 0, 0
        nodes[0], gaps[0], waiting = 0, gap2, 1
        while waiting > 0:
            waiting -= 1
            node = nodes[waiting]
            if gaps[waiting] >= best2:
                continue
            if node >= leaves - 1:
                start = (node - leaves + 1) * LEAF
                for t in range(start, min(start + LEAF, len(corners))):
                    own = _nearest_on_triangle(p, corners[t], here)
                    away2 = 0.0
                    for i in range(3):
                        away2 += (p[i] - here[i]) ** 2
                    if away2 < best2:
                        best2, triangle, part = away2, t, own
                        best[:] = here
                continue
            first, second = 2 * node + 1, 2 * node + 2
            gap_1, gap_2 = _box_gap2(p, low[first], high[first]), np.inf
            if low[second, 0] < np.inf:
                gap_2 = _box_gap2(p, low[second], high[second])
            if gap_1 > gap_2:
                first, second, gap_1, gap_2 = second, first, gap_2, gap_1
            # the nearer box is opened first
            if gap_2 < best2:
                nodes[waiting], gaps[waiting] = second, gap_2
                waiting += 1
            if gap_1 < best2:
                nodes[waiting], gaps[waiting] = first, gap_1
                waiting += 1
        side = 0.0
        for i in range(3):
            side += (p[i] - best[i]) * normals[triangle, part, i]
        distance[n] = math.copysign(math.sqrt(best2), side)
    return distance


@njit()
def _near(points, radii, corners, low, high, sphere, triangle):  # type: ignore[no-untyped-def]
    """Count the pairs of sphere and triangle that meet, and list them while there is room."""
    leaves = (len(low) + 1) // 2
    nodes, here = np.empty(_DEPTH, np.int64), np.empty(3)
    count = 0
    for n in range(len(points)):
        p, r2 = points[n], radii[n] ** 2
        nodes[0], waiting = 0, 1
        while waiting > 0:
            waiting -= 1
            node = nodes[waiting]
            if low[node, 0] == np.inf or _box_gap2(p, low[node], high[node]) >= r2:
                continue
            if node < leaves - 1:
                nodes[waiting], nodes[waiting + 1] = 2 * node + 1, 2 * node + 2
                waiting += 2
                continue
            start = (node - leaves + 1) * LEAF
            for t in range(start, min(start + LEAF, len(corners))):
                _nearest_on_triangle(p, corners[t], here)
                away2 = 0.0
                for i in range(3):
                    away2 += (p[i] - here[i]) ** 2
                if away2 < r2:
                    if count < len(sphere):
                        sphere[count], triangle[count] = n, t
                    count += 1
    return count
