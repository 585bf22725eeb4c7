"""The scene: flat walls, solids of every kind and the bores of tubes.

The vertical axis is the last one: y in 2D, z in 3D. Everything here is in the frame of the
moulding box, at rest.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import TypeVar

import numpy as np
from numpy.typing import NDArray

from sandmould.geometry.mesh import TriangleMesh
from sandmould.geometry.outline import Outline
from sandmould.geometry.revolved import Revolved

Array = NDArray[np.float64]
Facetted = TypeVar("Facetted", Outline, TriangleMesh)


@dataclass(frozen=True)
class Wall:
    """A flat wall of the moulding box, unbounded, with sand on the side of its normal."""

    name: str
    point_m: Array
    """(d,) float64, m: any point of the wall."""
    normal: Array
    """(d,) float64: unit normal pointing into the sand."""

    def distance_m(self, position_m: Array) -> Array:
        """Signed distance of points from the wall, positive on the sand's side, (n,) float64, m.

        Parameters
        ----------
        position_m : (n, d) float64, m
        """
        return (position_m - self.point_m) @ self.normal


_FACES = ((0, 1, 3, 2), (4, 6, 7, 5), (0, 4, 5, 1), (2, 3, 7, 6), (0, 2, 6, 4), (1, 5, 7, 3))
"""Corners of each face of a cuboid, counter-clockwise seen from outside."""


@dataclass(frozen=True)
class Block:
    """A solid rectangle (2D) or cuboid (3D) in any orientation."""

    name: str
    centre_m: Array
    """(d,) float64, m."""
    half_size_m: Array
    """(d,) float64, m: half lengths along the block's own axes."""
    axes: Array
    """(d, d) float64: the block's orthonormal axes, one a row."""

    def local(self, position_m: Array) -> Array:
        """Coordinates of points in the block's own axes, origin at its centre, (n, d) float64, m.

        Parameters
        ----------
        position_m : (n, d) float64, m
        """
        return (position_m - self.centre_m) @ self.axes.T

    def distance_m(self, position_m: Array) -> Array:
        """Signed distance of points from the block's surface, negative inside, (n,) float64, m.

        Parameters
        ----------
        position_m : (n, d) float64, m
        """
        excess = np.abs(self.local(position_m)) - self.half_size_m
        outside = np.linalg.norm(np.maximum(excess, 0.0), axis=1)
        inside = np.minimum(excess.max(axis=1), 0.0)
        return outside + inside

    def corners(self) -> Array:
        """Corners of the block, (2^d, d) float64, m."""
        d = len(self.centre_m)
        signs = np.array(np.meshgrid(*[[-1.0, 1.0]] * d, indexing="ij")).reshape(d, -1).T
        return self.centre_m + (signs * self.half_size_m) @ self.axes

    def facets(self) -> NDArray[np.int64]:
        """Corners of each side, (4, 2) int64 in 2D, or of each of its triangles, (12, 3) in 3D."""
        if len(self.centre_m) == 2:
            return np.array([[0, 2], [2, 3], [3, 1], [1, 0]])
        return np.array([half for a, b, c, d in _FACES for half in ((a, b, c), (a, c, d))])

    @property
    def measure(self) -> float:
        """Area (m2) of the block in 2D, its volume (m3) in 3D."""
        return float(np.prod(2.0 * self.half_size_m))


Solid = Block | Outline | TriangleMesh | Revolved


@dataclass(frozen=True)
class Bore:
    """The cavity of a tube: a straight prism from its mouth inwards.

    In 2D the section is an interval; in 3D a convex polygon, counter-clockwise in the plane of
    ``basis``.
    """

    name: str
    mouth_m: Array
    """(d,) float64, m: centre of the mouth."""
    axis: Array
    """(d,) float64: unit vector from the mouth into the tube."""
    length_m: float
    basis: Array
    """(d - 1, d) float64: orthonormal directions across the axis."""
    section_m: Array
    """(2, 1) float64, m in 2D: the interval's ends; (k, 2) float64, m in 3D: the vertices."""

    @property
    def section_measure(self) -> float:
        """Width (m) of the section in 2D, its area (m2) in 3D."""
        s = self.section_m
        if s.shape[1] == 1:
            return float(s[1, 0] - s[0, 0])
        x, y = s[:, 0], s[:, 1]
        return float(0.5 * np.sum(x * np.roll(y, -1) - np.roll(x, -1) * y))

    @property
    def measure(self) -> float:
        """Area (m2) of the bore in 2D, its volume (m3) in 3D."""
        return self.section_measure * self.length_m

    def local(self, position_m: Array) -> tuple[Array, Array]:
        """Depth behind the mouth and coordinates across the axis.

        Parameters
        ----------
        position_m : (n, d) float64, m

        Returns
        -------
        depth_m : (n,) float64, m
            Positive inside the tube.
        across_m : (n, d - 1) float64, m
        """
        relative = position_m - self.mouth_m
        return relative @ self.axis, relative @ self.basis.T


@dataclass(frozen=True, eq=False)
class Cavity:
    """A space that the sand should fill; what is round it does not belong to it."""

    name: str
    space: Solid
    """The space itself, as a solid would fill it."""
    inward: Array
    """(d,) float64: unit vector from the side it is open at into it; the axis of a round one."""

    def depth_m(self, position_m: Array) -> Array:
        """Depth of points behind the mouth, the plane across ``inward`` where the space begins.

        Parameters
        ----------
        position_m : (n, d) float64, m

        Returns
        -------
        (n,) float64, m
            Negative before the mouth.
        """
        return position_m @ self.inward - self._ends_m[0]

    @property
    def length_m(self) -> float:
        """Depth of its farthest point."""
        return self._ends_m[1] - self._ends_m[0]

    @property
    def _ends_m(self) -> tuple[float, float]:
        along_m = self.space.corners() @ self.inward
        return float(along_m.min()), float(along_m.max())


def distance_within(surface: Wall | Solid, position_m: Array, reach_m: float) -> Array:
    """Signed distance of points, (n,) float64, m; beyond a reach no more than the true one."""
    if isinstance(surface, Outline | TriangleMesh):
        return surface.distance_m(position_m, reach_m)
    return surface.distance_m(position_m)


@dataclass(frozen=True)
class Scene:
    """All that the sand can touch, and the cavities it should fill."""

    dimension: int
    walls: tuple[Wall, ...]
    blocks: tuple[Block, ...]
    bores: tuple[Bore, ...]
    outlines: tuple[Outline, ...] = ()
    """Solids of 2D other than rectangles."""
    meshes: tuple[TriangleMesh, ...] = ()
    """Solids of 3D given by triangles."""
    revolved: tuple[Revolved, ...] = ()
    """Round solids of 3D."""
    cavities: tuple[Cavity, ...] = ()
    """Spaces other than bores that the sand should fill; they bound nothing."""

    @property
    def solids(self) -> tuple[Solid, ...]:
        """All that fills space: every block, outline, mesh and round solid."""
        return (*self.blocks, *self.outlines, *self.meshes, *self.revolved)

    @property
    def top_m(self) -> float:
        """Height of the highest solid, 0 without any."""
        return max((float(solid.corners()[:, -1].max()) for solid in self.solids), default=0.0)

    def without(self, block: str) -> Scene:
        """The scene after one of its blocks was taken away."""
        return replace(self, blocks=tuple(b for b in self.blocks if b.name != block))

    def with_wall(self, wall: Wall) -> Scene:
        """The scene with a wall in the place of that of its name, or one more."""
        others = tuple(other for other in self.walls if other.name != wall.name)
        return replace(self, walls=(*others, wall))

    def bent(self, name: str, vertices_m: Array) -> Scene:
        """The scene with the vertices of one outline or mesh elsewhere, (k, d) float64, m."""

        def bent(solids: tuple[Facetted, ...]) -> tuple[Facetted, ...]:
            return tuple(replace(s, vertices_m=vertices_m) if s.name == name else s for s in solids)

        return replace(self, outlines=bent(self.outlines), meshes=bent(self.meshes))

    def clearance_m(self, position_m: Array, reach_m: float = np.inf) -> Array:
        """Distance of points from the nearest wall or solid, negative where inside one.

        Parameters
        ----------
        position_m : (n, d) float64, m
        reach_m : float, m, optional
            Distances beyond it need not be exact: they are never below it, nor above the true
            ones. It saves time at solids of many facets.

        Returns
        -------
        (n,) float64, m
        """
        surfaces = (*self.walls, *self.solids)
        return np.min([distance_within(s, position_m, reach_m) for s in surfaces], axis=0)
