"""What a pattern can touch beside the sand: floor, walls and obstacles, all at rest in the box."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from sandmould.geometry.geometry import Scene, Solid, distance_within
from sandmould.geometry.mesh import TriangleMesh
from sandmould.geometry.outline import Outline
from sandmould.geometry.revolved import Revolved
from sandmould.pattern_fe.nearest import nearest_on_facets
from sandmould.pattern_fe.perimeter import Perimeter

Array = NDArray[np.float64]
Indices = NDArray[np.int64]
_ROUND_SIDES = 32
"""Of a round obstacle, where points on it are looked for: vertices of the pattern meet it round."""

_PUSHES = 20
"""Of a surface out of what it has entered: corners of obstacles may need some."""


@dataclass(frozen=True)
class Gaps:
    """Places where a pattern may touch what surrounds it, one a row."""

    gap_m: Array
    """(m,) float64, m: distance, negative where one is in the other."""
    normal: Array
    """(m, d) float64: out of the wall or obstacle, towards the pattern."""
    vertices: Indices
    """(m, d) int64: of the pattern's facet; one vertex d times where it is that vertex."""
    shares: Array
    """(m, d) float64: of each, shape functions that sum to 1."""

    def opening_m(self, moved_m: Array) -> Array:
        """By how much a motion of the surface, (nv, d) float64, m, opens the gaps, (m,), m."""
        at = np.einsum("mk,mkd->md", self.shares, moved_m[self.vertices])
        return np.asarray(np.sum(self.normal * at, axis=1))

    def rows(self, vertices: int) -> Array:
        """The same as a matrix on all components, (m, nv d) float64."""
        m, d = self.normal.shape
        rows = np.zeros((m, vertices, d))
        for corner, share in zip(self.vertices.T, self.shares.T, strict=True):
            np.add.at(rows, (np.arange(m), corner), share[:, None] * self.normal)
        return rows.reshape(m, vertices * d)

    def only(self, chosen: Indices) -> Gaps:
        """Some of the rows."""
        return Gaps(
            self.gap_m[chosen], self.normal[chosen], self.vertices[chosen], self.shares[chosen]
        )


@dataclass(frozen=True)
class Clearance:
    """How far obstacles were from a pattern."""

    moved_m: Array
    """(nv, d) float64, m: its displacement then."""
    vertices_m: Array
    """(nv,) float64, m: distance of each vertex from the nearest obstacle."""
    points_m: float
    """Distance of the nearest corner or edge of an obstacle from the pattern, m."""


class Surroundings:
    """Floor, walls and obstacles round a pattern's outer surface."""

    def __init__(
        self,
        scene: Scene,
        outer: Perimeter,
        held: NDArray[np.bool_],
        own_name: str = "",
        reach_m: float = np.inf,
    ) -> None:
        """Take what a pattern can reach.

        Parameters
        ----------
        scene : Scene
            At rest in the frame of the box.
        outer : Perimeter
            The surface that the sand meets, as drawn.
        held : (nv, d) bool
            Components of its vertices that do not move: supports may touch what they stand on.
        own_name : str, optional
            Of the pattern, which may stand in the scene.
        reach_m : float, optional
            Displacement that no vertex exceeds.
        """
        self.drawn_m = outer.vertices_m
        """Vertices as drawn, (nv, d) float64, m."""
        self._facets = outer.facets
        self._held = held.all(axis=1)
        none = np.zeros((0, self.dimension))
        self._wall_normal = np.vstack([none, *(wall.normal for wall in scene.walls)])
        self._wall_at_m = np.array([wall.normal @ wall.point_m for wall in scene.walls])
        along_wall = held @ np.abs(self._wall_normal.T) > 0.0
        self._never_m = np.where(along_wall, np.inf, 0.0)
        low_m, high_m = self.drawn_m.min(axis=0) - reach_m, self.drawn_m.max(axis=0) + reach_m
        self.solids: tuple[Solid, ...] = tuple(
            solid for solid in scene.solids
            if solid.name != own_name
            and (solid.corners().max(axis=0) >= low_m).all()
            and (solid.corners().min(axis=0) <= high_m).all()
        )  # fmt: skip
        corners = outer.vertices_m[outer.facets]
        sides_m = np.linalg.norm(corners - np.roll(corners, 1, axis=1), axis=2)
        self._apart_m = float(sides_m.min())
        points = [self.drawn_m[:0]]
        for solid in self.solids:
            if self.dimension == 2:  # one of two outlines that overlap has a corner in the other
                points.append(_within(solid.corners(), low_m, high_m))
            else:
                points.append(points_on(solid, self._apart_m, low_m, high_m))
        self._points_m = np.concatenate(points)

    @property
    def dimension(self) -> int:
        """2 or 3."""
        return self.drawn_m.shape[1]

    @property
    def extent_m(self) -> float:
        """Largest side of the box round the drawing."""
        return float(np.ptp(self.drawn_m, axis=0).max())

    def wall_gaps_m(self, moved_m: Array) -> Array:
        """Distances of the vertices from floor and walls, (nv, walls) float64, m.

        Infinite where a vertex does not move that way.
        """
        gap_m = (self.drawn_m + moved_m) @ self._wall_normal.T - self._wall_at_m
        return np.asarray(gap_m + self._never_m)

    def overlapped_by(self) -> str | None:
        """Name of an obstacle that reaches into the pattern as drawn; None where none does."""
        least_m = -1e-6 * self.extent_m
        low_m, high_m = self.drawn_m.min(axis=0), self.drawn_m.max(axis=0)
        for solid in self.solids:
            points_m = points_on(solid, self._apart_m, low_m, high_m)
            gap_m = float(solid.distance_m(self.drawn_m).min())
            if len(points_m):
                inner_m = self._from_pattern_m(points_m, self.drawn_m, np.inf)
                gap_m = min(gap_m, float(inner_m.min()))
            if gap_m < least_m:
                return solid.name
        return None

    def bounds_m(self) -> tuple[Array, Array]:
        """Least and greatest displacements between floor and walls, both (nv, d) float64, m."""
        low, high = np.full_like(self.drawn_m, -np.inf), np.full_like(self.drawn_m, np.inf)
        gap_m = self.wall_gaps_m(np.zeros_like(self.drawn_m))
        for normal, away_m in zip(self._wall_normal, gap_m.T, strict=True):
            axis = int(np.abs(normal).argmax())
            if normal[axis] > 0.0:
                low[:, axis] = -away_m
            else:
                high[:, axis] = away_m
        return low, high

    def outlines_m(self) -> list[Array]:
        """Corners of each obstacle in turn, counter-clockwise, (k, 2) float64, m; in 2D."""
        return [
            solid.vertices_m if isinstance(solid, Outline) else solid.corners()[[0, 2, 3, 1]]
            for solid in self.solids
        ]

    @cached_property
    def as_drawn(self) -> Clearance:
        """Distances from obstacles as drawn."""
        return self.clearance(np.zeros_like(self.drawn_m))

    def clearance(self, moved_m: Array) -> Clearance:
        """Measure the distances from obstacles, for a displacement (nv, d) float64, m."""
        place_m = self.drawn_m + moved_m
        vertices_m = np.full(len(place_m), np.inf)
        for solid in self.solids:
            vertices_m = np.minimum(vertices_m, solid.distance_m(place_m))
        vertices_m[self._held] = np.inf
        points_m = np.inf
        if len(self._points_m):
            points_m = float(self._from_pattern_m(self._points_m, place_m, np.inf).min())
        return Clearance(moved_m, vertices_m, points_m)

    def is_clear(self, moved_m: Array, since: Clearance | None = None) -> bool:
        """Whether nothing touches, at next to no cost; False where that is not known.

        Floor and walls are planes. An obstacle touches no vertex that has gone less far than it was
        away, and its corners no facet whose vertices have. ``moved_m``: (nv, d) float64, m.
        ``since``: that it has moved from; the drawing unless given.
        """
        if self.wall_gaps_m(moved_m).min(initial=0.0) < 0.0:
            return False
        return self.is_clear_of_solids(moved_m, since)

    def is_clear_of_solids(self, moved_m: Array, since: Clearance | None = None) -> bool:
        """The same of obstacles alone."""
        if not self.solids:
            return True
        since = since or self.as_drawn
        way_m = np.linalg.norm(moved_m - since.moved_m, axis=1)
        return bool((way_m < since.vertices_m).all() and way_m.max() < since.points_m)

    def deepest_m(self, moved_m: Array) -> float:
        """How far a vertex is inside a wall or obstacle at most, or a corner in the pattern, m."""
        gaps = self.gaps(moved_m, 0.0)
        return -float(gaps.gap_m.min(initial=0.0))

    def gaps(self, moved_m: Array, within_m: float) -> Gaps:
        """All places nearer than a distance, for a displacement (nv, d) float64, m."""
        place_m = self.drawn_m + moved_m
        parts = [self._walls(moved_m, within_m)]
        parts += [self._solid(solid, place_m, within_m) for solid in self.solids]
        if len(self._points_m):
            parts.append(self._pointed(place_m, within_m))
        return Gaps(*(np.concatenate([getattr(p, name) for p in parts])
                      for name in ("gap_m", "normal", "vertices", "shares")))  # fmt: skip

    def pushed_out(self, moved_m: Array) -> Array:
        """A displacement that enters nothing: what is inside is moved out, the shortest way."""
        if self.is_clear(moved_m):
            return moved_m
        moved_m = moved_m.copy()
        for _ in range(_PUSHES):
            inside = self.gaps(moved_m, -1e-9 * self.extent_m)
            if not len(inside.gap_m):
                break
            # Several corners in one facet each push it by a part.
            together = np.bincount(inside.vertices[:, 0])[inside.vertices[:, 0]]
            size_m = -inside.gap_m / (np.sum(inside.shares**2, axis=1) * together)
            pushes_m = inside.shares[..., None] * (size_m[:, None] * inside.normal)[:, None]
            np.add.at(moved_m, inside.vertices, pushes_m)
        return moved_m

    def _walls(self, moved_m: Array, within_m: float) -> Gaps:
        gap_m = self.wall_gaps_m(moved_m)
        vertex, wall = np.nonzero(gap_m < within_m)
        return _of_vertices(gap_m[vertex, wall], self._wall_normal[wall], vertex)

    def _solid(self, solid: Solid, place_m: Array, within_m: float) -> Gaps:
        """Vertices near a solid; its normal is the slope of the distance from it."""
        gap_m = distance_within(solid, place_m, max(within_m, 0.0))
        vertex = np.flatnonzero((gap_m < within_m) & ~self._held)
        d, step_m = place_m.shape[1], 1e-7 * self.extent_m
        near_m = place_m[vertex]
        shifts = step_m * np.eye(d)
        around = np.concatenate([near_m + s for s in shifts] + [near_m - s for s in shifts])
        away_m = solid.distance_m(around).reshape(2, d, -1)
        slope = (away_m[0] - away_m[1]).T
        length = np.linalg.norm(slope, axis=1, keepdims=True)
        known = length[:, 0] > 0.0
        normal = slope[known] / length[known]
        return _of_vertices(gap_m[vertex][known], normal, vertex[known])

    def _pointed(self, place_m: Array, within_m: float) -> Gaps:
        """Points of obstacles near facets of the pattern."""
        points_m = self._points_m
        away_m = self._from_pattern_m(points_m, place_m, max(within_m, 0.0))
        near = away_m < within_m
        away_m = away_m[near]
        facet, shares, at_m = nearest_on_facets(points_m[near], place_m[self._facets])
        vertices = self._facets[facet]
        outward = place_m[vertices]
        if place_m.shape[1] == 2:
            edge = outward[:, 1] - outward[:, 0]
            facing = np.stack([edge[:, 1], -edge[:, 0]], axis=1)
        else:
            facing = np.cross(outward[:, 1] - outward[:, 0], outward[:, 2] - outward[:, 0])
        facing /= np.linalg.norm(facing, axis=1, keepdims=True)
        to_point = points_m[near] - at_m
        length = np.linalg.norm(to_point, axis=1, keepdims=True)
        touches = length[:, 0] <= 1e-9 * self.extent_m
        sign = np.where(away_m < 0.0, -1.0, 1.0)[:, None]
        outward = np.where(touches[:, None], facing, sign * to_point / np.maximum(length, 1e-300))
        return Gaps(away_m, -outward, vertices, shares)

    def _from_pattern_m(self, points_m: Array, place_m: Array, within_m: float) -> Array:
        """Signed distances of points from the pattern; beyond a distance no more than true."""
        if place_m.shape[1] == 2:
            return Outline("pattern", place_m).distance_m(points_m, within_m)
        return TriangleMesh("pattern", place_m, self._facets).distance_m(points_m, within_m)


def _of_vertices(gap_m: Array, normal: Array, vertex: Indices) -> Gaps:
    d = normal.shape[1]
    shares = np.zeros((len(vertex), d))
    shares[:, 0] = 1.0
    return Gaps(gap_m, normal, np.repeat(vertex[:, None], d, axis=1), shares)


def points_on(solid: Solid, apart_m: float, low_m: Array, high_m: Array) -> Array:
    """Points along all edges of a solid that may lie inside a pattern, (k, d) float64, m.

    ``apart_m``: distance of the points: vertices of the pattern are farther apart. ``low_m``,
    ``high_m``, (d,) float64, m: box that the pattern may reach; points outside it are left out.
    """
    if isinstance(solid, Revolved):
        solid = solid.mesh(_ROUND_SIDES)
    corners = solid.corners()
    if isinstance(solid, Outline):
        number = np.arange(len(corners))
        facets = np.stack([number, np.roll(number, -1)], axis=1)
    else:
        facets = solid.triangles if isinstance(solid, TriangleMesh) else solid.facets()
    ends = np.concatenate([np.roll(facets, -i, axis=1)[:, :2] for i in range(facets.shape[1])])
    ends = np.unique(np.sort(ends, axis=1), axis=0)
    low, high = np.sort(corners[ends], axis=1).transpose(1, 0, 2)
    ends = ends[((low <= high_m) & (high >= low_m)).all(axis=1)]
    parts = [corners[:0]]
    for start, end in corners[ends]:
        count = 2 + int(np.linalg.norm(end - start) / apart_m)
        parts.append(start + np.linspace(0.0, 1.0, count)[:, None] * (end - start))
    return _within(np.concatenate(parts), low_m, high_m)


def _within(points: Array, low_m: Array, high_m: Array) -> Array:
    return np.unique(points[((points >= low_m) & (points <= high_m)).all(axis=1)], axis=0)
