"""Surfaces that grains touch: planes, segments, triangles and surfaces of revolution.

All of them lie in the frame of the moulding box, which the solver may displace as a whole. Every
surface has vertices; a plane and a surface of revolution have one, which only carries their load
and velocity.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike

from sandmould.arrays import Floats, Ints
from sandmould.compiled import njit
from sandmould.dem.vectors import OPTIONS

STAYS = -1
"""Steps left of a vertex that does not move; its velocity is felt all the same, as on a belt."""


class SurfaceArrays(NamedTuple):
    """All surfaces of a scene as compiled code takes them.

    A part is a plane, one line of a profile of revolution or a facet, numbered in this order.
    """

    vertices: Floats
    """(nv, d) float64, m."""
    vertex_velocity: Floats
    """(nv, d) float64, m/s, in the frame of the box."""
    steps_left: Ints
    """(nv,) int64: steps that a vertex still moves with its velocity, or ``STAYS``."""
    planes: Ints
    """(1,) int64: number of planes."""
    shape: Floats
    """(np, 7) float64 of planes and lines. Unit normal of a plane into the sand, or unit axis of a
    line and its ends in the meridian plane: axial and radial, axial and radial, m."""
    corner: Ints
    """(nf, d) int64: vertices of each part; a plane and a line hang on one vertex alone."""


def _rows(values: ArrayLike, columns: int, what: str) -> Floats:
    rows = np.array(values, dtype=np.float64, order="C", ndmin=2)
    if rows.ndim != 2 or rows.shape[1] != columns:
        raise ValueError(f"{what} has the shape {rows.shape}, valid is (n, {columns})")
    if not np.isfinite(rows).all():
        raise ValueError(f"{what} has a coordinate that is not finite")
    return rows


def _unit(direction: ArrayLike, d: int, what: str) -> Floats:
    rows = _rows(direction, d, what)
    length = float(np.linalg.norm(rows))
    if length == 0.0:
        raise ValueError(f"{what} has no direction")
    return rows / length


class Surfaces:
    """The surfaces of a scene by name.

    Several facets make one surface; the loads on the vertices of a surface sum to the force that
    it carries.
    """

    def __init__(self, dimension: int) -> None:
        d = self.dimension = dimension
        self._range: dict[str, slice] = {}
        self._shape_of: dict[str, Floats] = {"plane": np.empty((0, 7)), "line": np.empty((0, 7))}
        self._corner_of = {
            kind: np.empty((0, d), dtype=np.int64) for kind in ("plane", "line", "facet")
        }
        self.arrays = SurfaceArrays(
            np.empty((0, d)),
            np.empty((0, d)),
            np.empty(0, dtype=np.int64),
            np.zeros(1, dtype=np.int64),
            self._shape_of["plane"],
            self._corner_of["facet"],
        )
        """Replaced by additions and removals, changed in place by motion."""

    @property
    def names(self) -> tuple[str, ...]:
        """Names in the order of addition."""
        return tuple(self._range)

    def vertices_of(self, name: str) -> slice:
        """Which vertices, and so which rows of the loads, belong to a surface."""
        return self._range[name]

    def add_plane(self, name: str, point_m: ArrayLike, normal: ArrayLike) -> None:
        """Add an unbounded plane with the sand on the side of its normal.

        A grain whose centre has passed it is still pushed back. ``point_m``, (d,) float64, m: any
        point of the plane. ``normal``, (d,) float64: of any length.
        """
        d = self.dimension
        shape = np.zeros((1, 7))
        shape[0, :d] = _unit(normal, d, f"normal of surface {name}")
        point = _rows(point_m, d, f"point of surface {name}")
        self._add(name, point, "plane", np.zeros((1, d), dtype=np.int64), shape)

    def add_facets(self, name: str, vertices_m: ArrayLike, facets: ArrayLike) -> None:
        """Add segments (2D) or triangles (3D), open or closed, touched from either side.

        ``vertices_m``: (nv, d) float64, m. ``facets``, (nf, d) int64: vertices of each facet.

        Raises
        ------
        ValueError
            When a facet has no extent or names a vertex that is not there.
        """
        vertices = _rows(vertices_m, self.dimension, f"vertices of surface {name}")
        numbers = np.array(facets, dtype=np.int64, ndmin=2)
        if numbers.shape[1] != self.dimension:
            valid = f"(n, {self.dimension})"
            raise ValueError(f"facets of surface {name} have shape {numbers.shape}, valid: {valid}")
        if numbers.min(initial=0) < 0 or numbers.max(initial=0) >= len(vertices):
            raise ValueError(f"a facet of surface {name} names a vertex that is not there")
        edges = vertices[numbers[:, 1:]] - vertices[numbers[:, :1]]
        extent = np.linalg.det(edges @ edges.transpose(0, 2, 1))
        if (extent <= 0.0).any():
            raise ValueError(f"facet {int(extent.argmin())} of surface {name} has no extent")
        self._add(name, vertices, "facet", numbers)

    def add_revolved(
        self, name: str, origin_m: ArrayLike, axis: ArrayLike, profile_m: ArrayLike, closed: bool
    ) -> None:
        """Add the surface that a line of straight pieces sweeps round an axis; 3D alone.

        A tube is a rectangle revolved, a solid cylinder a rectangle with one side on the axis.
        A grain too large for a bore touches it on one side alone.

        Parameters
        ----------
        origin_m, axis : (3,) float64, m
            A point of the axis and its direction, of any length.
        profile_m : (k, 2) float64, m
            Axial and radial coordinates of the corners of the line.
        closed : bool
            Whether a last piece joins the last corner with the first.
        """
        if self.dimension != 3:
            raise ValueError(f"surface {name} is one of revolution, valid in 3D alone")
        profile = _rows(profile_m, 2, f"profile of surface {name}")
        if (profile[:, 1] < 0.0).any():
            raise ValueError(f"profile of surface {name} has a negative radial coordinate")
        ends = np.roll(profile, -1, axis=0)
        lines = np.hstack([profile, ends]) if closed else np.hstack([profile, ends])[:-1]
        # A piece on the axis itself has no surface.
        lines = lines[(lines[:, 1] > 0.0) | (lines[:, 3] > 0.0)]
        if not len(lines) or (lines[:, :2] == lines[:, 2:]).all(axis=1).any():
            raise ValueError(f"profile of surface {name} has a piece of no length, or none at all")
        unit = _unit(axis, 3, f"axis of surface {name}")
        shape = np.hstack([np.repeat(unit, len(lines), axis=0), lines])
        origin = _rows(origin_m, 3, f"origin of surface {name}")
        self._add(name, origin, "line", np.zeros((len(lines), 3), dtype=np.int64), shape)

    def _add(
        self, name: str, vertices: Floats, kind: str, corner: Ints, shape: Floats | None = None
    ) -> None:
        if name in self._range:
            raise ValueError(f"surface {name} is there twice")
        old = self.arrays
        first = len(old.vertices)
        self._range[name] = slice(first, first + len(vertices))
        self._corner_of[kind] = np.concatenate([self._corner_of[kind], corner + first])
        if shape is not None:
            self._shape_of[kind] = np.concatenate([self._shape_of[kind], shape])
        self._set_arrays(
            np.concatenate([old.vertices, vertices]),
            np.concatenate([old.vertex_velocity, np.zeros_like(vertices)]),
            np.concatenate([old.steps_left, np.full(len(vertices), STAYS)]),
        )

    def _set_arrays(self, vertices: Floats, velocity: Floats, steps_left: Ints) -> None:
        """Join the parts of all kinds on given vertices."""
        self.arrays = SurfaceArrays(
            vertices,
            velocity,
            steps_left,
            np.array([len(self._corner_of["plane"])]),
            np.concatenate([self._shape_of["plane"], self._shape_of["line"]]),
            np.concatenate([self._corner_of[k] for k in ("plane", "line", "facet")]),
        )

    def remove(self, name: str) -> None:
        """Take a surface away; the others keep their order."""
        rows = self._range.pop(name)
        gone = rows.stop - rows.start
        for other, its in self._range.items():
            if its.start >= rows.stop:
                self._range[other] = slice(its.start - gone, its.stop - gone)
        for kind, corner in self._corner_of.items():
            stays = (corner[:, 0] < rows.start) | (corner[:, 0] >= rows.stop)
            left = corner[stays]
            self._corner_of[kind] = left - gone * (left >= rows.stop)
            if kind in self._shape_of:
                self._shape_of[kind] = self._shape_of[kind][stays]
        old = self.arrays
        self._set_arrays(
            np.delete(old.vertices, rows, axis=0),
            np.delete(old.vertex_velocity, rows, axis=0),
            np.delete(old.steps_left, rows),
        )

    def set_motion(
        self, name: str, target_vertices_m: ArrayLike, window_s: float, step_s: float
    ) -> None:
        """Let a surface move evenly to new vertices within a window, then stay there.

        ``target_vertices_m``: (nv, d) float64, m. ``window_s``, ``step_s``: the window is rounded
        up to whole steps.
        """
        rows = self._range[name]
        target = _rows(target_vertices_m, self.dimension, f"target of surface {name}")
        now = self.arrays.vertices[rows]
        if target.shape != now.shape:
            raise ValueError(f"target of surface {name} has {len(target)} vertices, not {len(now)}")
        steps = max(1, math.ceil(window_s / step_s * (1 - 1e-12)))
        self.arrays.vertex_velocity[rows] = (target - now) / (steps * step_s)
        self.arrays.steps_left[rows] = steps

    def forces(self, loads: Floats) -> dict[str, Floats]:
        """Sum the loads on the vertices of each surface, (d,) float64, N, by its name.

        ``loads``: (nv, d) float64, N.
        """
        return {name: loads[rows].sum(axis=0) for name, rows in self._range.items()}


@njit(**OPTIONS)
def move_vertices(arrays: SurfaceArrays, dt: float) -> float:
    """Drift all moving vertices by one step, as the grains drift; gives the longest way, m.

    The velocity stays after the last step until the next call: the contacts of that step feel it.
    """
    vertices, velocity, left = arrays.vertices, arrays.vertex_velocity, arrays.steps_left
    fastest2 = 0.0
    for i in range(len(left)):
        if left[i] > 0:
            speed2 = 0.0
            for k in range(vertices.shape[1]):
                vertices[i, k] += velocity[i, k] * dt
                speed2 += velocity[i, k] * velocity[i, k]
            left[i] -= 1
            fastest2 = max(fastest2, speed2)
        elif left[i] == 0:
            for k in range(vertices.shape[1]):
                velocity[i, k] = 0.0
            left[i] = STAYS
    return math.sqrt(fastest2) * dt


@njit(**OPTIONS)
def farthest_moved(arrays: SurfaceArrays, since: Floats) -> float:
    """Largest distance (m) of a vertex from where it was, (nv, d) float64, m."""
    largest2 = 0.0
    for i in range(len(since)):
        moved2 = 0.0
        for k in range(since.shape[1]):
            moved2 += (arrays.vertices[i, k] - since[i, k]) ** 2
        largest2 = max(largest2, moved2)
    return math.sqrt(largest2)
