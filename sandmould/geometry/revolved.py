"""Solids of 3D that are round about an axis."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from sandmould.geometry.mesh import TriangleMesh
from sandmould.geometry.outline import meridian_distance_m

Array = NDArray[np.float64]


@dataclass(frozen=True)
class Revolved:
    """The solid that a closed polygon sweeps when it turns about an axis."""

    name: str
    origin_m: Array
    """(3,) float64, m: point of the axis from which the profile counts."""
    axis: Array
    """(3,) float64: unit vector along the axis."""
    profile_m: Array
    """(k, 2) float64, m: vertices of the polygon, counter-clockwise: place along the axis,
    distance from it. Edges on the axis bound nothing."""

    def distance_m(self, position_m: Array) -> Array:
        """Signed distance of points from the surface, negative inside, (n,) float64, m.

        Parameters
        ----------
        position_m : (n, 3) float64, m
        """
        relative_m = position_m - self.origin_m
        along_m = relative_m @ self.axis
        off_axis_m = np.linalg.norm(relative_m - along_m[:, None] * self.axis, axis=1)
        return meridian_distance_m(np.column_stack([along_m, off_axis_m]), self.profile_m)

    def corners(self) -> Array:
        """Outermost points of the solid along the axes of space, (m, 3) float64, m."""
        across = np.eye(3) - np.outer(self.axis, self.axis)
        length = np.linalg.norm(across, axis=1)
        outward = across[length > 1e-9] / length[length > 1e-9, None]
        directions = np.concatenate([outward, -outward])
        along_m, off_axis_m = self.profile_m.T
        centres_m = self.origin_m + along_m[:, None] * self.axis
        points_m = centres_m[:, None] + off_axis_m[:, None, None] * directions
        return points_m.reshape(-1, 3)

    @property
    def measure(self) -> float:
        """Volume, m3: the polygon's first moment about the axis times a whole turn (Pappus)."""
        a, r = self.profile_m.T
        b, s = np.roll(a, -1), np.roll(r, -1)
        return float(math.pi / 3.0 * np.sum((a * s - b * r) * (r + s)))

    def mesh(self, sides: int = 128) -> TriangleMesh:
        """Triangles in place of the round surface, of the same volume.

        Distances from the axis are widened so that every section across it keeps its area; the
        surface then lies within (pi/sides)^2/3 of its radius from the round one: 2e-4 of it for
        128 sides.
        """
        step = 2.0 * math.pi / sides
        widened = math.sqrt(step / math.sin(step))
        first = np.eye(3)[int(np.argmin(np.abs(self.axis)))]
        first = first - (first @ self.axis) * self.axis
        first /= np.linalg.norm(first)
        second = np.cross(self.axis, first)
        vertices: list[Array] = []
        rings: list[NDArray[np.int64]] = []
        for along_m, off_axis_m in self.profile_m:
            start, angle = len(vertices), step * np.arange(sides if off_axis_m > 0.0 else 1)
            outward = np.outer(np.cos(angle), first) + np.outer(np.sin(angle), second)
            vertices += list(self.origin_m + along_m * self.axis + widened * off_axis_m * outward)
            # a vertex on the axis stands for its whole ring
            rings.append(np.broadcast_to(np.arange(start, len(vertices)), sides).copy())
        triangles = []
        for ring, next_ring in zip(rings, rings[1:] + rings[:1], strict=True):
            ring_turned, next_turned = np.roll(ring, -1), np.roll(next_ring, -1)
            triangles += [
                np.stack([ring, next_ring, next_turned], 1),
                np.stack([ring, next_turned, ring_turned], 1),
            ]
        every = np.concatenate(triangles)
        whole = (every != np.roll(every, 1, axis=1)).all(axis=1)
        return TriangleMesh(self.name, np.array(vertices), every[whole].astype(np.int64))
