"""Vertices that a cut left on flat faces and straight edges, taken away again.

They make narrow triangles, which LIGGGHTS refuses under an angle of 0.06 degrees.
"""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Iterable

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]
Ints = NDArray[np.int64]
_ONE_PLANE = 1e-4
"""Sine of the angle between triangles of one face: rounded vertices turn small ones."""


def simplified(
    vertices: Array, triangles: Ints, needless: Iterable[int], near: float
) -> tuple[Array, Ints]:
    """Take vertices away that no corner of the surface needs.

    A vertex is moved into a neighbour, along its edge where it lies on one, and only where that
    leaves the surface in place and makes no angle smaller than the least round it.

    Parameters
    ----------
    vertices : (nv, 3) float64
    triangles : (nt, 3) int64
        A closed surface with two triangles an edge.
    needless : iterable of int
        Vertices that may go.
    near : float
        Distance by which the surface may move.

    Returns
    -------
    vertices : (mv, 3) float64
    triangles : (mt, 3) int64
    """
    surface = _Surface(vertices, triangles, near)
    left = list(needless)
    while left:
        stay = [v for v in left if not surface.drop(v)]
        if len(stay) == len(left):
            break
        left = stay
    kept, corner = np.unique(np.array(list(surface.triangles.values())), return_inverse=True)
    return vertices[kept], corner.reshape(-1, 3).astype(np.int64)


class _Surface:
    """Triangles by number, and those round each vertex."""

    def __init__(self, vertices: Array, triangles: Ints, near: float) -> None:
        self.near = near
        self.place = vertices
        self.triangles = dict(enumerate(map(tuple, triangles.tolist())))
        self.round: dict[int, set[int]] = defaultdict(set)
        for number, triangle in self.triangles.items():
            for v in triangle:
                self.round[v].add(number)

    def drop(self, v: int) -> bool:
        """Move a vertex into the best neighbour; False where none will do."""
        own = sorted(self.round[v])
        corners = self.place[np.array([self.triangles[t] for t in own])]
        normals, least = shapes(corners)
        faces: list[Array] = []
        for n in normals:
            if not any(n @ f > 0.0 and np.linalg.norm(np.cross(n, f)) < _ONE_PLANE for f in faces):
                faces.append(n)
        if len(faces) > 2:
            return False
        best, best_angle = -1, 0.0
        for u in sorted({w for t in own for w in self.triangles[t]} - {v}):
            angle = self._angle_after(v, u, own, faces)
            if angle > best_angle:
                best, best_angle = u, angle
        if best < 0 or best_angle < least.min():
            return False
        for t in own:
            triangle = self.triangles[t]
            if best in triangle:
                for w in triangle:
                    self.round[w].discard(t)
                del self.triangles[t]
            else:
                self.triangles[t] = tuple(best if w == v else w for w in triangle)
                self.round[best].add(t)
        del self.round[v]
        return True

    def _angle_after(self, v: int, u: int, own: list[int], faces: list[Array]) -> float:
        """Least angle round a vertex moved into another; 0 where it may not be."""
        beside = [t for t in own if u in self.triangles[t]]
        others = [t for t in own if u not in self.triangles[t]]
        step = self.place[u] - self.place[v]
        # along the edge of two faces, or within the one
        if any(abs(step @ face) > self.near for face in faces) or len(beside) != 2 or not others:
            return 0.0
        common = self._neighbours(v) & self._neighbours(u)
        if len(common) != 2:
            return 0.0
        corners = self.place[
            np.array([[u if w == v else w for w in self.triangles[t]] for t in others])
        ]
        before, _ = shapes(self.place[np.array([self.triangles[t] for t in others])])
        after, least = shapes(corners)
        turned = np.sum(before * after, axis=1) < np.sqrt(1.0 - _ONE_PLANE**2)
        return 0.0 if turned.any() else float(least.min())

    def _neighbours(self, v: int) -> set[int]:
        return {w for t in self.round[v] for w in self.triangles[t]} - {v}


def shapes(corners: Array) -> tuple[Array, Array]:
    """Unit normals of triangles, (n, 3), and the sine of the least angle of each, (n,)."""
    a, b, c = corners.transpose(1, 0, 2)
    normal = np.cross(b - a, c - a)
    area2 = np.linalg.norm(normal, axis=1)
    sides = np.sort([np.linalg.norm(e, axis=1) for e in (b - a, c - b, a - c)], axis=0)
    safe = np.where(area2 > 0.0, area2, 1.0)
    return normal / safe[:, None], area2 / np.maximum(sides[1] * sides[2], 1e-300)
