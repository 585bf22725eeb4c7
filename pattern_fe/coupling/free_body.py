"""A pattern that sand alone holds, at rest in its own shape wherever it has come to."""

from __future__ import annotations

from functools import cached_property

import numpy as np
from numpy.typing import NDArray
from scipy.linalg import qr
from scipy.sparse.linalg import SuperLU

from sandmould.pattern_fe.coupling.body import StaticSolution
from sandmould.pattern_fe.coupling.foam_body import cross
from sandmould.pattern_fe.coupling.in_step_foam import InStepFoam
from sandmould.pattern_fe.pattern import Pattern
from sandmould.pattern_fe.space import factorised
from sandmould.pattern_fe.supports import rigid_motions

Array = NDArray[np.float64]


class FreeBody:
    """A free pattern under the loads of the sand and of what it touches, small displacements.

    What they leave accelerates it as a rigid body, so that this share is taken off with the masses
    (inertia relief); the rest is in balance and bends it. Where it lies no load tells: the solution
    lies as near to the moving pattern as it can.
    """

    def __init__(self, pattern: Pattern, foam: InStepFoam) -> None:
        """Follow a pattern.

        ``pattern``: that nothing holds. ``foam``: the same in motion: where it is, and what it
        touches.
        """
        self._pattern, self._foam = pattern, foam
        self._surface = pattern.surface.outer
        self._rigid = rigid_motions(pattern.space.node_m)

    @property
    def vertices_m(self) -> Array:
        """Vertices of the outer surface as drawn, (nv, d) float64, m."""
        return self._surface.vertices_m

    @cached_property
    def _loose(self) -> NDArray[np.int64]:
        """All components but as few as hold the pattern, where they hold it best."""
        _, _, order = qr(self._rigid.T, mode="economic", pivoting=True)
        return np.sort(order[self._rigid.shape[1] :])

    @cached_property
    def _factor(self) -> SuperLU:
        return factorised(self._pattern.stiffness[self._loose][:, self._loose])

    def solve(self, load_n: Array) -> StaticSolution:
        """Find the shape under loads on the outer surface, (nv, d) float64, N."""
        pattern, rigid = self._pattern, self._rigid
        contact_n = self._foam.mean_contact_n
        whole = self._surface.motion.T @ (load_n + contact_n)
        inertia = np.repeat(pattern.mass_kg, whole.shape[1])[:, None] * rigid
        left = rigid.T @ whole.ravel()
        balanced = whole.ravel() - inertia @ np.linalg.solve(rigid.T @ inertia, left)
        shape = np.zeros_like(balanced)
        shape[self._loose] = self._factor.solve(balanced[self._loose])
        on_surface = self._at(shape[:, None])
        rigid_there = self._at(rigid)
        away = self._foam.displacement_m.ravel() - on_surface[:, 0]
        place, *_ = np.linalg.lstsq(rigid_there, away, rcond=None)
        nodes_m = (shape + rigid @ place).reshape(whole.shape)
        moment = cross(pattern.space.node_m, whole).sum(axis=0)
        return StaticSolution(
            self._surface.motion @ nodes_m,
            nodes_m,
            0.5 * float(shape @ balanced),
            np.asarray(contact_n.sum(axis=0)),
            float(np.linalg.norm(moment)),
            contact_n if contact_n.any() else None,
        )

    def _at(self, columns: Array) -> Array:
        """Motions of the outer surface, (nv d, k), for those of all nodes, (n d, k)."""
        motion = self._surface.motion
        moved = motion @ columns.reshape(motion.shape[1], -1)
        return np.asarray(moved.reshape(-1, columns.shape[1]))
