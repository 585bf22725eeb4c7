"""Solids of 3D bounded by triangles."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

if TYPE_CHECKING:
    from sandmould.geometry.mesh_search import MeshSearch

Array = NDArray[np.float64]


@dataclass(frozen=True)
class TriangleMesh:
    """A solid of 3D bounded by a closed surface of triangles."""

    name: str
    vertices_m: Array
    """(nv, 3) float64, m."""
    triangles: NDArray[np.int64]
    """(nt, 3) int64: vertices of each triangle, counter-clockwise seen from outside."""

    @cached_property
    def _search(self) -> MeshSearch:
        # numba takes a fifth of a second to import: only scenes with meshes pay for it
        from sandmould.geometry.mesh_search import MeshSearch

        return MeshSearch(self.vertices_m, self.triangles)

    def distance_m(self, position_m: Array, reach_m: float = np.inf) -> Array:
        """Signed distance of points from the surface, negative inside, (n,) float64, m.

        Parameters
        ----------
        position_m : (n, 3) float64, m
        reach_m : float, m, optional
            Distances beyond it need not be exact: a point farther than this from the box round
            the mesh is given its distance from that box, which is no more than the true one.
        """
        return self._search.distance_m(position_m, reach_m)

    def holds(self, position_m: Array) -> NDArray[np.bool_]:
        """Whether points are inside: where the surface goes round them once or more, (n,) bool.

        Far quicker than the sign of a distance.

        Parameters
        ----------
        position_m : (n, 3) float64, m
        """
        one = np.zeros(len(self.triangles), dtype=np.int64)
        return np.asarray(self._search.windings(position_m, one)[:, 0] > 0)

    def near_triangles(
        self, position_m: Array, radius_m: Array
    ) -> tuple[NDArray[np.int64], NDArray[np.int64]]:
        """List the triangles that spheres meet.

        Parameters
        ----------
        position_m : (n, 3) float64, m
        radius_m : (n,) float64, m

        Returns
        -------
        sphere, triangle : (p,) int64
            Indices of the members of each pair.
        """
        return self._search.near_triangles(position_m, radius_m)

    @property
    def corners_m(self) -> Array:
        """Corners of each triangle, (nt, 3, 3) float64, m."""
        return self.vertices_m[self.triangles]

    def corners(self) -> Array:
        """Corners of the solid, (nv, 3) float64, m."""
        return self.vertices_m

    @property
    def measure(self) -> float:
        """Volume, m3."""
        return float(signed_volumes_m3(self.vertices_m, self.triangles).sum())

    @property
    def surface_m2(self) -> float:
        """Area of its surface, m2."""
        a, b, c = self.corners_m.transpose(1, 0, 2)
        return float(0.5 * np.linalg.norm(np.cross(b - a, c - a), axis=1).sum())

    def section_m(self, axis: int, place_m: float) -> list[Array]:
        """Closed outlines in which a plane across a coordinate axis cuts the solid.

        Parameters
        ----------
        axis : int
            Index of the axis.
        place_m : float, m
            Where the plane crosses it; vertices on the plane count as beyond it.

        Returns
        -------
        list of (k, 2) float64, m
            In the other two coordinates; outer outlines run one way, those of holes the other.
        """
        beyond = self.vertices_m[:, axis] >= place_m
        above = beyond[self.triangles].sum(axis=1)
        cut = self.triangles[(above > 0) & (above < 3)]
        # each triangle leads from the edge on which its rim comes back to that on which it leaves
        following: dict[tuple[int, int], tuple[int, int]] = {}
        for triangle in cut.tolist():
            rim = [(triangle[i], triangle[(i + 1) % 3]) for i in range(3)]
            back = next((b, a) for a, b in rim if beyond[a] and not beyond[b])
            following[back] = next(e for e in rim if not beyond[e[0]] and beyond[e[1]])
        across = [i for i in range(3) if i != axis]
        loops = []
        while following:
            edges = [next(iter(following))]
            while edges[-1] in following:
                edges.append(following.pop(edges[-1]))
            a, b = np.array(edges[:-1]).T
            low_m, high_m = self.vertices_m[a], self.vertices_m[b]
            share = (place_m - low_m[:, axis]) / (high_m[:, axis] - low_m[:, axis])
            loops.append((low_m + share[:, None] * (high_m - low_m))[:, across])
        return loops


def signed_volumes_m3(vertices_m: Array, triangles: NDArray[np.int64]) -> Array:
    """Volumes between each triangle and one vertex, positive seen from behind, (nt,) float64, m3.

    Their sum is the volume inside a closed surface.
    """
    # from a vertex, or digits are lost far from the origin
    a, b, c = (vertices_m[triangles] - vertices_m[triangles[0, 0]]).transpose(1, 0, 2)
    return np.asarray(np.sum(a * np.cross(b, c), axis=1) / 6.0)
