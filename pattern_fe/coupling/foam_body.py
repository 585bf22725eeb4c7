"""The foam pattern as a participant of the coupling."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from pattern_fe.coupling.body import StaticSolution
from pattern_fe.elasticity import internal_force_n
from pattern_fe.pattern import Pattern

Array = NDArray[np.float64]


def cross(place_m: Array, force_n: Array) -> Array:
    """Moments of forces about the origin, (n, 1) in 2D or (n, 3) in 3D, N m."""
    if place_m.shape[1] == 3:
        return np.asarray(np.cross(place_m, force_n))
    return place_m[:, :1] * force_n[:, 1:] - place_m[:, 1:] * force_n[:, :1]


class FoamBody:
    """A pattern at rest under the loads on its outer surface."""

    def __init__(self, pattern: Pattern, large: bool = False) -> None:
        """Stand as drawn.

        Parameters
        ----------
        pattern : Pattern
        large : bool
            Whether displacements are large.
        """
        self._pattern = pattern
        self._large = large
        self._line = pattern.surface.outer_line

    @property
    def vertices_m(self) -> Array:
        """Vertices of the outer surface as drawn, (nv, d) float64, m."""
        return self._pattern.surface.vertices_m[self._line]

    def solve(self, load_n: Array) -> StaticSolution:
        """Find the pattern at rest under loads on the outer surface, (nv, d) float64, N."""
        pattern = self._pattern
        on_surface = np.zeros_like(pattern.surface.vertices_m)
        on_surface[self._line] = load_n
        load = pattern.on_nodes(on_surface)
        moved = pattern.solve_nonlinear(load) if self._large else pattern.solve_linear(load)
        reaction = self._inner_force_n(moved) - load
        reaction[~pattern.fixed.any(axis=1)] = 0.0
        # Small displacements balance on the drawing, large ones where the nodes have come to.
        place_m = pattern.space.node_m + (moved if self._large else 0.0)
        outer = load + reaction
        moment = cross(place_m, outer).sum(axis=0)
        return StaticSolution(
            pattern.on_surface(moved)[self._line],
            pattern.energy_j(moved, self._large),
            np.asarray(reaction.sum(axis=0)),
            float(np.linalg.norm(moment)),
        )

    def _inner_force_n(self, moved_m: Array) -> Array:
        pattern = self._pattern
        if self._large:
            return internal_force_n(pattern.space, pattern.foam, moved_m)
        return np.asarray((pattern.stiffness @ moved_m.ravel()).reshape(moved_m.shape))
