"""The outer surface of a pattern, as an engine takes it: vertices and flat facets.

Every node on the boundary has a vertex, so an edge of second order becomes two segments; a
quadrilateral of first order has one more in its middle. One matrix leads from nodes to vertices: by
it vertices move, and by its transpose their forces, which grains share among the corners of a facet
by linear shape functions, become those of nodes. So the work of the sand is what the pattern
receives, and force and moment are exact.
It is the matrix by which facets move in the mean as the face does. A parabola fills 2/3 of its
height and a line with a kink 1/2, so a vertex between corners goes 4/3 as far from their mean as
its node. An even pressure then loads nodes by the integrals of their shape functions, those of an
edge 1:4:1, on flat and on twisted faces.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray
from scipy.sparse import coo_array, csr_array

from sandmould.geometry.mesh import TriangleMesh
from sandmould.geometry.outline import Outline
from sandmould.pattern_fe.space import Space

Array = NDArray[np.float64]
Indices = NDArray[np.int64]
_BULGE = 4.0 / 3.0
"""How far a vertex goes from the mean of the corners beside it, over how far its node goes."""


@dataclass(frozen=True)
class Perimeter:
    """Closed surface of a pattern, segments in 2D and triangles in 3D, solid behind them."""

    vertices_m: Array
    """(nv, d) float64, m."""
    facets: Indices
    """(nf, d) int64: vertices of each; in 2D the solid lies left of them, in 3D they run
    counter-clockwise seen from outside."""
    motion: csr_array
    """(nv, n) sparse float64: shares of the nodes' displacements in those of the vertices."""
    loops: tuple[slice, ...]
    """In 2D the vertices of each closed line in the order of its segments; empty in 3D."""
    thickness_m: float
    """Out of the plane in 2D, 1 in 3D."""

    @property
    def nodes(self) -> Indices:
        """Nodes of the pattern on it, ascending, (k,) int64."""
        return np.unique(self.motion.indices).astype(np.int64)

    @property
    def facet_area_vector_m2(self) -> Array:
        """Area of each facet times its outward normal, (nf, d) float64, m2."""
        corners = self.vertices_m[self.facets]
        edges = corners[:, 1:] - corners[:, :1]
        if corners.shape[2] == 2:
            return self.thickness_m * np.stack([edges[:, 0, 1], -edges[:, 0, 0]], axis=1)
        return np.asarray(0.5 * np.cross(edges[:, 0], edges[:, 1]))

    @property
    def vertex_area_vector_m2(self) -> Array:
        """Each vertex's even share of the facets around it, (nv, d) float64, m2."""
        return self._shared(self.facet_area_vector_m2)

    @property
    def vertex_area_m2(self) -> Array:
        """A_j of eq. (56): the vertex's even share of the areas around it, (nv,) float64, m2."""
        area = np.linalg.norm(self.facet_area_vector_m2, axis=1)
        return self._shared(area[:, None])[:, 0]

    @property
    def outer_line(self) -> slice:
        """Vertices that the sand meets: in 2D those of the outermost line, in 3D all."""
        vertices = self.vertices_m
        if not self.loops:
            return slice(0, len(vertices))
        return max(self.loops, key=lambda loop: np.ptp(vertices[loop], axis=0).max())

    @property
    def outer(self) -> Perimeter:
        """What the sand meets as a surface of its own; in 2D one line."""
        if not self.loops:
            return self
        line = self.outer_line
        of_line = self.facets[(self.facets >= line.start).all(1) & (self.facets < line.stop).all(1)]
        whole = slice(0, line.stop - line.start)
        return replace(
            self,
            vertices_m=self.vertices_m[line],
            facets=of_line - line.start,
            motion=self.motion[line],
            loops=(whole,),
        )

    def _shared(self, values: Array) -> Array:
        shared = np.zeros((len(self.vertices_m), values.shape[1]))
        for corner in self.facets.T:
            np.add.at(shared, corner, values / self.facets.shape[1])
        return shared

    def moved(self, displacement_m: Array) -> Perimeter:
        """Surface whose vertices are displaced, (nv, d) float64, m."""
        return replace(self, vertices_m=self.vertices_m + displacement_m)

    def held(self, fixed: NDArray[np.bool_]) -> NDArray[np.bool_]:
        """Components of vertices that do not move, (nv, d) bool, for those of nodes, (n, d)."""
        return np.asarray(abs(self.motion) @ (~fixed).astype(np.float64) == 0.0)


def perimeter_of(space: Space) -> Perimeter:
    """Find the outer surface of a pattern.

    Raises
    ------
    ValueError
        When it is not closed, or touches itself in a point or along a line.
    """
    motion = _motion(space)
    place_m = motion @ space.node_m
    mesh = space.node_mesh
    faces = mesh.boundary_facets()
    behind_m = mesh.p[:, mesh.t[:, mesh.f2t[0, faces]]].mean(axis=1).T
    facets = mesh.facets[:, faces].T
    if facets.shape[1] == 4:
        middle = len(space.node_m) + faces if space.order == 1 else None
        facets, parts = _split(facets, middle)
        behind_m = np.repeat(behind_m, parts, axis=0)
    facets = _outward(place_m, facets, behind_m)
    if space.dimension == 2:
        order, loops = _closed_lines(place_m, facets)
    else:
        _check_closed(facets)
        order, loops = np.unique(facets), ()
    number = np.full(len(place_m), -1)
    number[order] = np.arange(len(order))
    facets = number[facets]
    if loops:
        facets = facets[facets[:, 0].argsort()]
    return Perimeter(place_m[order], facets, motion[order], loops, space.thickness_m)


def _motion(space: Space) -> csr_array:
    """Shares of nodes in the motion of places of facets, (places, n) float64: nodes, then faces."""
    mesh, n, corners = space.mesh, len(space.node_m), space.mesh.nvertices
    between = [] if space.order == 1 else [mesh.edges.T if mesh.dim() == 3 else mesh.facets.T]
    if len(mesh.facets) == 4:
        between.append(mesh.facets.T)
    parts = [(np.arange(corners), np.arange(corners), np.ones(corners))]
    first = corners
    for ends in between:
        row, own = first + np.arange(len(ends)), _BULGE if first < n else 0.0
        parts.append((row, np.minimum(row, n - 1), np.full(len(ends), own)))
        share = np.full(ends.size, (1.0 - own) / ends.shape[1])
        parts.append((np.repeat(row, ends.shape[1]), ends.ravel(), share))
        first += len(ends)
    row, column, value = (np.concatenate(part) for part in zip(*parts, strict=True))
    return csr_array(coo_array((value, (row, column)), shape=(first, n)))


def _split(faces: Indices, middle: Indices | None) -> tuple[Indices, int]:
    """Triangles of quadrilaterals and their number in each."""
    # In a mesh twice as fine a corner of the first mesh has the least number: they begin there.
    if middle is not None:
        ends = np.stack([faces, np.roll(faces, -1, axis=1)], axis=2)
        around = np.broadcast_to(middle[:, None, None], (len(faces), 4, 1))
        return np.concatenate([ends, around], axis=2).reshape(-1, 3), 4
    turns = (faces.argmin(axis=1)[:, None] + np.arange(4)) % 4
    turned = np.take_along_axis(faces, turns, axis=1)
    return turned[:, [[0, 1, 2], [0, 2, 3]]].reshape(-1, 3), 2


def _outward(node_m: Array, facets: Indices, inside_m: Array) -> Indices:
    """Turn facets so that their normals point away from a point inside the element behind."""
    corners = node_m[facets]
    edges = corners[:, 1:] - corners[:, :1]
    if facets.shape[1] == 2:
        normal = np.stack([edges[:, 0, 1], -edges[:, 0, 0]], axis=1)
    else:
        normal = np.cross(edges[:, 0], edges[:, 1])
    inward = np.sum(normal * (corners.mean(axis=1) - inside_m), axis=1) < 0.0
    return np.where(inward[:, None], facets[:, ::-1], facets)


def _closed_lines(node_m: Array, segments: Indices) -> tuple[Indices, tuple[slice, ...]]:
    """Nodes of all closed lines one after another, and where each begins and ends."""
    starts = np.bincount(segments[:, 0], minlength=len(node_m))
    ends = np.bincount(segments[:, 1], minlength=len(node_m))
    bad = np.flatnonzero((starts != ends) | (starts > 1))
    if len(bad):
        place = ", ".join(f"{x:.4g}" for x in node_m[bad[0]])
        raise ValueError(
            f"outline of the pattern is open or touches itself at {len(bad)} nodes, one at "
            f"({place}) m; valid are closed lines apart from one another"
        )
    following = dict(segments.tolist())
    order: list[int] = []
    loops = []
    while following:
        first = len(order)
        node = min(following)
        while node in following:
            order.append(node)
            node = following.pop(node)
        loops.append(slice(first, len(order)))
    return np.array(order, dtype=np.int64), tuple(loops)


def _check_closed(triangles: Indices) -> None:
    """Each edge must belong to two triangles that run along it in opposite ways."""
    ends = np.concatenate([triangles[:, [i, (i + 1) % 3]] for i in range(3)])
    _, edge, count = np.unique(np.sort(ends), axis=0, return_inverse=True, return_counts=True)
    way = np.bincount(edge.ravel(), weights=np.where(ends[:, 0] < ends[:, 1], 1.0, -1.0))
    bad = int(((count != 2) | (way != 0.0)).sum())
    if bad:
        raise ValueError(
            f"surface of the pattern is open or touches itself along {bad} edges, valid is a "
            "closed surface of which two triangles meet in every edge"
        )


@dataclass(frozen=True)
class Distance:
    """Distances of a deformed surface from the surface drawn."""

    vertex_m: Array
    """(nv,) float64, m: of each vertex; positive where it is outside the drawing."""
    largest_m: float
    rms_m: float
    """Root of the mean square over the deformed surface, by area."""


def distance_from_drawing(drawn: Perimeter, deformed: Perimeter) -> Distance:
    """Measure from each vertex of the deformed surface to the nearest point of the drawn one.

    What slides along itself has no distance.
    """
    place_m = deformed.vertices_m
    if drawn.loops:
        away_m = _from_lines_m(drawn, place_m)
    else:
        away_m = TriangleMesh("drawn", drawn.vertices_m, drawn.facets).distance_m(place_m)
    rms_m = float(np.sqrt(np.average(away_m**2, weights=deformed.vertex_area_m2)))
    return Distance(away_m, float(np.abs(away_m).max()), rms_m)


def _from_lines_m(drawn: Perimeter, place_m: Array) -> Array:
    """Signed distance from closed lines; the solid lies left of them, so holes run clockwise."""
    distances_m = []
    for loop in drawn.loops:
        vertices_m = drawn.vertices_m[loop]
        x, y = vertices_m.T
        is_outer = np.dot(x, np.roll(y, -1)) > np.dot(y, np.roll(x, -1))
        away_m = Outline("drawn", vertices_m).distance_m(place_m)
        distances_m.append(away_m if is_outer else -away_m)
    return np.asarray(np.max(distances_m, axis=0))
