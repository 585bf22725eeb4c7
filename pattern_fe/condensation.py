"""A pattern seen from its surface: stiffness of its nodes there, and mass of its vertices."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import NDArray
from scipy.linalg import eigh
from scipy.sparse import csc_array, csr_array

from sandmould.pattern_fe.space import factorised
from sandmould.pattern_fe.supports import Mask

Array = NDArray[np.float64]
_COLUMNS = 256
"""Solved for together."""


@dataclass(frozen=True)
class CondensedSurface:
    """What is stepped beside an engine's grains.

    Components run node by node or vertex by vertex, x before y before z. Vertices that are held
    have an infinite mass, so that no force moves them; the stiffness keeps the rows of held nodes,
    which give the supports' reactions.
    """

    stiffness_n_m: Array
    """(n, n) float64, N/m, symmetric: of the nodes on the surface."""
    fixed: NDArray[np.bool_]
    """(n,) bool: components of these nodes that do not move."""
    mass_kg: Array
    """(nv,) float64, kg: of components of the vertices, infinite where held."""
    motion: Array
    """(nv, n) float64: shares of the nodes' displacements in those of the vertices."""
    loose: int = 0
    """Motions that nothing holds and that bend nothing."""

    @cached_property
    def modes(self) -> tuple[Array, Array]:
        """Free oscillations of the masses of the vertices.

        Returns
        -------
        square_1_s2 : (m,) float64, 1/s2
            Squares of the angular frequencies, ascending, of as many modes as free components; 0
            of loose motions.
        shape : (nv, m) float64, kg^-1/2
            Motion of the vertices in columns of unit modal mass, 0 where held.
        """
        free, moves = ~self.fixed, np.isfinite(self.mass_kg)
        motion = self.motion[:, free]
        mass = motion[moves].T @ (self.mass_kg[moves, None] * motion[moves])
        square, shape = eigh(self.stiffness_n_m[np.ix_(free, free)], mass)
        square[: self.loose] = 0.0
        return square, motion @ shape


def condensed_surface(
    stiffness: csc_array, mass_kg: Array, motion: csr_array, fixed: Mask, loose: int = 0
) -> CondensedSurface:
    """Schur complement on the nodes of a surface, exact for static loads on it (Guyan 1965).

    Memory for the square of its components is needed a few times over.

    Parameters
    ----------
    stiffness : (N d, N d) sparse float64, N/m
        Of all nodes.
    mass_kg : (nv,) float64, kg
        Of the vertices.
    motion : (nv, N) sparse float64
        See ``Perimeter``.
    fixed : (N, d) bool
    loose : int, optional
        Rigid motions that nothing holds.
    """
    d, nodes = fixed.shape[1], np.unique(motion.indices)
    retained = (nodes[:, None] * d + np.arange(d)).ravel()
    # what is held inside does not move
    inner = np.setdiff1d(np.flatnonzero(~fixed.ravel()), retained)
    schur = stiffness[retained][:, retained].toarray()
    if len(inner):
        factor = factorised(stiffness[inner][:, inner])
        coupling = stiffness[inner][:, retained]
        for first in range(0, len(retained), _COLUMNS):
            columns = slice(first, first + _COLUMNS)
            schur[:, columns] -= coupling.T @ factor.solve(coupling[:, columns].toarray())
    moving = np.kron(motion[:, nodes].toarray(), np.eye(d))
    held = fixed.ravel()[retained]
    mass = np.where(moving[:, ~held].any(axis=1), np.repeat(mass_kg, d), np.inf)
    return CondensedSurface(0.5 * (schur + schur.T), held, mass, moving, loose)
