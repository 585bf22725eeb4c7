"""The foam pattern as the staggered loop asks it."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from pattern_fe.coupling.body import Answer
from pattern_fe.elasticity import internal_force_n
from pattern_fe.pattern import Pattern

Array = NDArray[np.float64]


class FoamBody:
    """A pattern at rest under the loads on its outer line."""

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
        """Vertices of the outer line as drawn, (nv, 2) float64, m."""
        return self._pattern.surface.vertices_m[self._line]

    def answer(self, load_n: Array) -> Answer:
        """Find the pattern at rest under loads on the outer line, (nv, 2) float64, N."""
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
        moment = place_m[:, 0] * outer[:, 1] - place_m[:, 1] * outer[:, 0]
        return Answer(
            pattern.on_surface(moved)[self._line],
            pattern.energy_j(moved, self._large),
            np.asarray(reaction.sum(axis=0)),
            abs(float(moment.sum())),
        )

    def _inner_force_n(self, moved_m: Array) -> Array:
        pattern = self._pattern
        if self._large:
            return internal_force_n(pattern.space, pattern.foam, moved_m)
        return np.asarray((pattern.stiffness @ moved_m.ravel()).reshape(moved_m.shape))
