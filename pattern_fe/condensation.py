"""A pattern seen from its surface: stiffness and mass on the vertices alone."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import NDArray
from scipy.linalg import eigh
from scipy.sparse import csc_array

from sandmould.pattern_fe.factor import factorised
from sandmould.pattern_fe.supports import Mask

Array = NDArray[np.float64]
_COLUMNS = 256
"""Solved for together."""


@dataclass(frozen=True)
class CondensedSurface:
    """What is stepped beside an engine's grains: stiffness and mass at the vertices.

    Components run vertex by vertex, x before y before z. Held ones have an infinite mass, so that
    no force moves them; the stiffness keeps their rows, which give the supports' reactions.
    """

    stiffness_n_m: Array
    """(n, n) float64, N/m, symmetric."""
    mass_kg: Array
    """(n,) float64, kg; infinite where held."""
    loose: int = 0
    """Motions that nothing holds and that bend nothing."""

    @cached_property
    def modes(self) -> tuple[Array, Array]:
        """Free oscillations of the masses.

        Returns
        -------
        square_1_s2 : (m,) float64, 1/s2
            Squares of the angular frequencies, ascending, of as many modes as free components; 0
            of loose motions.
        shape : (n, m) float64, kg^-1/2
            Columns of unit modal mass, 0 where held.
        """
        free = np.isfinite(self.mass_kg)
        square, part = eigh(self.stiffness_n_m[np.ix_(free, free)], np.diag(self.mass_kg[free]))
        square[: self.loose] = 0.0
        shape = np.zeros((len(free), len(square)))
        shape[free] = part
        return square, shape


def condensed_surface(
    stiffness: csc_array,
    mass_kg: Array,
    nodes: NDArray[np.int64],
    fixed: Mask,
    loose: int = 0,
) -> CondensedSurface:
    """Schur complement on some nodes, exact for static loads on them (Guyan 1965).

    Parameters
    ----------
    stiffness : (N d, N d) sparse float64, N/m
        Of all nodes.
    mass_kg : (n,) float64, kg
        Of the retained nodes.
    nodes : (n,) int64
        Retained.
    fixed : (N, d) bool
    loose : int, optional
        Rigid motions that nothing holds.

    Returns
    -------
    CondensedSurface
        Of n d components; memory for (n d)^2 numbers is needed a few times over.
    """
    d = fixed.shape[1]
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
    held = fixed.ravel()[retained]
    mass = np.where(held, np.inf, np.repeat(mass_kg, d))
    return CondensedSurface(0.5 * (schur + schur.T), mass, loose)
