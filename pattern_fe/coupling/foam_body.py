"""The foam pattern as a participant of the coupling."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray
from scipy.sparse import csr_array

from sandmould.pattern_fe.contact import touch
from sandmould.pattern_fe.coupling.body import StaticSolution
from sandmould.pattern_fe.elasticity import internal_force_n
from sandmould.pattern_fe.pattern import Pattern
from sandmould.pattern_fe.surroundings import Surroundings

Array = NDArray[np.float64]
_LINEARISATIONS = 40
"""Of gaps round obstacles; some ten are enough."""
_WHOLE_WAYS = 12
"""The first of them."""
_STAYS = 1e-7
"""Share of the extent by which a surface may still move when it has come to rest."""


def cross(place_m: Array, force_n: Array) -> Array:
    """Moments of forces about the origin, (n, 1) in 2D or (n, 3) in 3D, N m."""
    if place_m.shape[1] == 3:
        return np.asarray(np.cross(place_m, force_n))
    return place_m[:, :1] * force_n[:, 1:] - place_m[:, 1:] * force_n[:, :1]


class FoamBody:
    """A pattern at rest under the loads on its outer surface, beside floor, walls and obstacles."""

    def __init__(
        self, pattern: Pattern, large: bool = False, surroundings: Surroundings | None = None
    ) -> None:
        """Stand as drawn."""
        self._pattern = pattern
        self._large = large
        self._surface = pattern.surface.outer
        self._motion = self._surface.motion
        self._to_nodes = csr_array(self._motion.T)
        """Of loads on the surface; made once, for it is asked for in every pass of the loop."""
        self._surroundings = surroundings
        self._compliance: dict[int, Array] = {}
        """Displacements of the surface under 1 N on a component of it, by its number."""

    @property
    def vertices_m(self) -> Array:
        """Vertices of the outer surface as drawn, (nv, d) float64, m."""
        return self._surface.vertices_m

    def solve(self, load_n: Array) -> StaticSolution:
        """Find the pattern at rest under loads on the outer surface, (nv, d) float64, N."""
        pattern, load = self._pattern, self._to_nodes @ load_n
        if self._large:
            moved, contact_n = pattern.solve_large(load, self._surroundings)
        else:
            moved, contact_n = self._linear(load)
        inner = self._inner_force_n(moved)
        energy_j = pattern.energy_j(moved, True) if self._large else 0.5 * np.vdot(inner, moved)
        held = np.asarray((pattern.fixed | (self._to_nodes @ contact_n != 0.0)).any(axis=1))
        reaction = np.where(held[:, None], inner - load, 0.0)
        if pattern.supports.bedding_n_m3:
            reaction += pattern.bedding_force_n(moved)
        # Small displacements balance on the drawing, large ones where the nodes have come to.
        place_m = pattern.space.node_m + (moved if self._large else 0.0)
        outer = load + reaction
        moment = cross(place_m, outer).sum(axis=0)
        return StaticSolution(
            self._motion @ moved,
            moved,
            float(energy_j),
            np.asarray(reaction.sum(axis=0)),
            float(np.linalg.norm(moment)),
            contact_n if contact_n.any() else None,
        )

    def _linear(self, load: Array) -> tuple[Array, Array]:
        """Small displacements of all nodes, and the loads of what the vertices touch."""
        # Floor and walls are one problem; gaps of obstacles are linearised until it stays.
        pattern, around = self._pattern, self._surroundings
        moved, at_m = pattern.solve_linear(load), np.zeros_like(self.vertices_m)
        free_m = self._motion @ moved
        if around is None or around.is_clear(free_m):
            return moved, at_m
        for number in range(_LINEARISATIONS):
            contact = touch(around, at_m, free_m, self._response)
            led_m = free_m if contact is None else contact.moved_m
            near_m = _STAYS * around.extent_m
            stays = bool(np.abs(led_m - at_m).max() <= near_m)
            # At a corner two linearisations may lead to one another: half of the way is between.
            at_m = led_m if number < _WHOLE_WAYS else 0.5 * (at_m + led_m)
            if stays or (not around.solids and around.deepest_m(at_m) <= near_m):
                break
        if contact is None:
            return moved, np.zeros_like(at_m)
        return pattern.solve_linear(load + self._to_nodes @ contact.load_n), contact.load_n

    def _response(self, load_n: Array) -> Array:
        """Displacements of the surface under loads on it, (nv d, m); those of one load are kept."""
        for entry in np.flatnonzero(load_n.any(axis=1)):
            if entry not in self._compliance:
                unit = np.zeros_like(self.vertices_m)
                unit.ravel()[entry] = 1.0
                moved = self._pattern.solve_linear(self._to_nodes @ unit)
                self._compliance[int(entry)] = (self._motion @ moved).ravel()
        used = np.flatnonzero(load_n.any(axis=1))
        if not len(used):
            return np.zeros_like(load_n)
        return np.column_stack([self._compliance[int(e)] for e in used]) @ load_n[used]

    def _inner_force_n(self, moved_m: Array) -> Array:
        pattern = self._pattern
        if self._large:
            return internal_force_n(pattern.space, pattern.foam, moved_m)
        return np.asarray((pattern.stiffness @ moved_m.ravel()).reshape(moved_m.shape))
