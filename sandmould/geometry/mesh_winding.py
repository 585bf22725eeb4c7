"""How often surfaces go round points, counted along rays by compiled code."""

from __future__ import annotations

import numpy as np

from sandmould.compiled import njit

LEAF = 4
"""Triangles in a leaf of the tree."""


@njit()
def windings(points, corners, shell, shells, low, high):  # type: ignore[no-untyped-def]
    """Winding number of each shell round each point, (n, shells) int64.

    A ray goes up from the point; a triangle that it leaves through counts 1, one that it enters
    through -1. Edges are taken half open and always from the same end, so that a ray through an
    edge or a vertex meets one of the triangles there.

    Parameters
    ----------
    points : (n, 3) float64
    corners : (nt, 3, 3) float64
        In the order of the tree's leaves.
    shell : (nt,) int64
        Which shell each triangle belongs to.
    shells : int
    low, high : (nodes, 3) float64
        Boxes of the tree, as :class:`sandmould.geometry.mesh_search.MeshSearch` has them.
    """
    leaves = (len(low) + 1) // 2
    nodes = np.empty(64, np.int64)
    counts = np.zeros((len(points), shells), np.int64)
    for n in range(len(points)):
        x, y, z = points[n]
        nodes[0], waiting = 0, 1
        while waiting > 0:
            waiting -= 1
            node = nodes[waiting]
            # an empty node's box lies infinitely far away
            if not (low[node, 0] <= x <= high[node, 0] and low[node, 1] <= y <= high[node, 1]):
                continue
            if high[node, 2] < z:
                continue
            if node < leaves - 1:
                nodes[waiting], nodes[waiting + 1] = 2 * node + 1, 2 * node + 2
                waiting += 2
                continue
            start = (node - leaves + 1) * LEAF
            for t in range(start, min(start + LEAF, len(corners))):
                way = _way_through(corners[t], x, y)
                if way != 0 and _is_above(corners[t], way, x, y, z):
                    counts[n, shell[t]] += way
    return counts


@njit()
def _way_through(t, x, y):  # type: ignore[no-untyped-def]
    """1 where a line upwards leaves through a triangle, -1 where it enters, 0 where it misses."""
    way = 0
    for k in range(3):
        m = (k + 1) % 3
        if (t[k, 0] <= x) != (t[m, 0] <= x):
            a, b, sign = (k, m, -1) if t[k, 0] < t[m, 0] else (m, k, 1)
            beyond = (t[b, 0] - t[a, 0]) * (y - t[a, 1]) - (t[b, 1] - t[a, 1]) * (x - t[a, 0])
            if beyond < 0.0:
                way += sign
    return way


@njit()
def _is_above(t, way, x, y, z):  # type: ignore[no-untyped-def]
    """Whether a triangle that a line upwards passes lies above a point of the line."""
    if min(t[0, 2], t[1, 2], t[2, 2]) > z:
        return True
    if max(t[0, 2], t[1, 2], t[2, 2]) < z:
        return False
    ux, uy, uz = t[1, 0] - t[0, 0], t[1, 1] - t[0, 1], t[1, 2] - t[0, 2]
    vx, vy, vz = t[2, 0] - t[0, 0], t[2, 1] - t[0, 1], t[2, 2] - t[0, 2]
    px, py, pz = x - t[0, 0], y - t[0, 1], z - t[0, 2]
    volume = px * (uy * vz - uz * vy) + py * (uz * vx - ux * vz) + pz * (ux * vy - uy * vx)
    return volume * way < 0.0
