"""The outer surface of a pattern, as an engine takes it: vertices and flat facets.

Every node on the boundary is a vertex, those inside edges and faces too, so an edge of second
order becomes two segments. A contact force shared among the corners of a facet by linear shape
functions is then a set of nodal forces of the pattern as it stands: loads are conservative, force
and moment exact; displacements are consistent, the motion of the surface under the grain is that of
the nodes; and no mapping lies in between.
Corners alone would be half as many but would not see the pattern bend inside an element. What
differs from the integrals of the quadratic shape functions are local shares: an even pressure on
an edge loads its nodes 1:2:1, not 1:4:1, with the same force and moment.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from sandmould.pattern_fe.space import Space

Array = NDArray[np.float64]
Indices = NDArray[np.int64]


@dataclass(frozen=True)
class Perimeter:
    """Closed surface of a pattern, segments in 2D and triangles in 3D, solid behind them."""

    vertices_m: Array
    """(nv, d) float64, m."""
    facets: Indices
    """(nf, d) int64: vertices of each; in 2D the solid lies left of them, in 3D they run
    counter-clockwise seen from outside."""
    nodes: Indices
    """(nv,) int64: node of the pattern at each vertex."""
    loops: tuple[slice, ...]
    """In 2D the vertices of each closed line in the order of its segments; empty in 3D."""
    thickness_m: float
    """Out of the plane in 2D, 1 in 3D."""

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
            nodes=self.nodes[line],
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


def perimeter_of(space: Space) -> Perimeter:
    """Find the outer surface of a pattern.

    Raises
    ------
    ValueError
        When it is not closed, or touches itself in a point or along a line.
    """
    mesh = space.mesh
    faces = mesh.boundary_facets()
    cell = mesh.f2t[0, faces]
    local = (mesh.t2f[:, cell] == faces).argmax(axis=0)
    table = [face_parts(space, number) for number in range(mesh.refdom.nfacets)]
    parts = np.array(
        [[space.cells[c, p] for p in table[k]] for c, k in zip(cell, local, strict=True)]
    )
    centre = space.node_m[space.cells[cell, : mesh.refdom.nnodes]].mean(axis=1)
    facets = parts.reshape(-1, parts.shape[2])
    facets = _outward(space.node_m, facets, np.repeat(centre, parts.shape[1], axis=0))
    if space.dimension == 2:
        order, loops = _closed_lines(space.node_m, facets)
    else:
        _check_closed(facets)
        order, loops = np.unique(facets), ()
    number = np.full(len(space.node_m), -1)
    number[order] = np.arange(len(order))
    facets = number[facets]
    if loops:
        facets = facets[facets[:, 0].argsort()]
    return Perimeter(space.node_m[order], facets, order, loops, space.thickness_m)


def face_parts(space: Space, face: int) -> list[tuple[int, ...]]:
    """Flat parts of a face of an element, as columns of ``space.cells``."""
    domain = space.mesh.refdom
    corners = domain.facets[face]
    if space.order == 1:
        return _halves(corners) if len(corners) == 4 else [tuple(corners)]
    if space.dimension == 2:
        middle = domain.nnodes + face
        return [(corners[0], middle), (middle, corners[1])]
    edges = [domain.nnodes + _edge(domain.edges, corners, i) for i in range(len(corners))]
    centre = domain.nnodes + domain.nedges + face if len(corners) == 4 else None
    return split_face(corners, edges, centre)


def _halves(corners: Sequence[int]) -> list[tuple[int, ...]]:
    a, b, c, d = corners
    return [(a, b, c), (a, c, d)]


def _edge(edges: Sequence[Sequence[int]], corners: Sequence[int], i: int) -> int:
    ends = sorted((corners[i], corners[(i + 1) % len(corners)]))
    return [sorted(edge) for edge in edges].index(ends)


def split_face(
    corners: Sequence[int], edges: Sequence[int], centre: int | None
) -> list[tuple[int, ...]]:
    """Triangles between all nodes of a face of second order, turning as its corners do.

    Parameters
    ----------
    corners, edges : sequence of int
        Nodes at the corners in order, and between each and the next.
    centre : int or None
        Node in the middle of a quadrilateral; a triangle has none.
    """
    parts: list[tuple[int, ...]] = []
    for i, corner in enumerate(corners):
        if centre is None:
            parts.append((corner, edges[i], edges[i - 1]))
        else:
            parts += [(corner, edges[i], centre), (corner, centre, edges[i - 1])]
    return parts if centre is not None else [*parts, tuple(edges)]


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
