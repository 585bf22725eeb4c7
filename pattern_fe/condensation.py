"""A pattern seen from its surface: stiffness and mass on the vertices alone."""

from __future__ import annotations

import math
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray
from scipy.linalg import eigh, eigvalsh
from scipy.sparse import csc_array

from pattern_fe.factor import factorised
from pattern_fe.supports import Mask

Array = NDArray[np.float64]
_COLUMNS = 256
"""Solved for together."""


@dataclass(frozen=True)
class CondensedSurface:
    """What an engine steps beside its grains: M a + C v + S u = f at the vertices.

    Components run vertex by vertex, x before y before z. Held ones have an infinite mass, so that
    no force moves them; the stiffness keeps their rows, which give the supports' reactions.
    """

    stiffness_n_m: Array
    """(n, n) float64, N/m, symmetric."""
    mass_kg: Array
    """(n,) float64, kg; infinite where held."""
    damping_n_s_m: Array
    """(n,) float64, N s/m; 0 where held."""
    mass_scale: float = 1.0
    """Factor already in the masses."""

    def scaled(self, mass_scale: float) -> CondensedSurface:
        """Multiply the masses, damping ratios kept: statics stay, frequencies fall by its root.

        Raises
        ------
        ValueError
            When it is not positive.
        """
        if not 0.0 < mass_scale < np.inf:
            raise ValueError(f"mass scale of the pattern is {mass_scale:g}, valid is above 0")
        return replace(
            self,
            mass_kg=mass_scale * self.mass_kg,
            damping_n_s_m=math.sqrt(mass_scale) * self.damping_n_s_m,
            mass_scale=mass_scale * self.mass_scale,
        )

    def scaled_to_step(
        self, step_s: float, share: float = 0.5, contact_n_m: float = 0.0
    ) -> CondensedSurface:
        """Masses just large enough for a time step.

        Parameters
        ----------
        step_s : float, s
        share : float
            Of the critical step that the step shall be.
        contact_n_m : float, N/m
            Stiffness of the contacts at any one vertex.
        """
        return self.scaled((step_s / (share * self.critical_step_s(contact_n_m))) ** 2)

    def _omega2(self, contact_n_m: float = 0.0) -> Array:
        """Squares of the angular frequencies, ascending, 1/s2."""
        free = np.isfinite(self.mass_kg)
        root = 1.0 / np.sqrt(self.mass_kg[free])
        stiffness = self.stiffness_n_m[np.ix_(free, free)]
        stiffness = stiffness + contact_n_m * np.eye(len(root))
        return np.asarray(eigvalsh(root[:, None] * stiffness * root))

    def modes(self) -> tuple[Array, Array]:
        """Free oscillations of the masses.

        Returns
        -------
        square_1_s2 : (m,) float64, 1/s2
            Squares of the angular frequencies, ascending, of as many modes as free components.
        shape : (n, m) float64, kg^-1/2
            Columns of unit modal mass, 0 where held.
        """
        free = np.isfinite(self.mass_kg)
        square, part = eigh(self.stiffness_n_m[np.ix_(free, free)], np.diag(self.mass_kg[free]))
        shape = np.zeros((len(free), len(square)))
        shape[free] = part
        return square, shape

    def frequencies_hz(self) -> Array:
        """Natural frequencies, ascending; those of rigid motions are near 0."""
        return np.asarray(np.sqrt(np.maximum(self._omega2(), 0.0)) / (2.0 * math.pi))

    def critical_step_s(self, contact_n_m: float = 0.0) -> float:
        """2/omega of the highest frequency, with contacts of a stiffness at every vertex.

        The dashpots of contacts and their number at one vertex lower the limit.
        """
        return 2.0 / math.sqrt(float(self._omega2(contact_n_m)[-1]))


def condensed_surface(
    stiffness: csc_array,
    mass_kg: Array,
    nodes: NDArray[np.int64],
    fixed: Mask,
    damping_1_s: float,
) -> CondensedSurface:
    """Schur complement on some nodes, exact for static loads on them (Guyan 1965).

    Parameters
    ----------
    stiffness : (N d, N d) sparse float64, N/m
        Of all nodes.
    mass_kg : (n,) float64, kg
        Of the nodes kept.
    nodes : (n,) int64
        Kept, all those with a support among them.
    fixed : (N, d) bool
    damping_1_s : float, 1/s
        Rayleigh's mass damping: 4 pi f zeta for a damping ratio zeta at the frequency f.

    Returns
    -------
    CondensedSurface
        Of n d components; memory for (n d)^2 numbers is needed a few times over.
    """
    d = fixed.shape[1]
    kept = (nodes[:, None] * d + np.arange(d)).ravel()
    inner = np.setdiff1d(np.arange(fixed.size), kept)
    schur = stiffness[kept][:, kept].toarray()
    if len(inner):
        factor = factorised(stiffness[inner][:, inner])
        coupling = stiffness[inner][:, kept]
        for first in range(0, len(kept), _COLUMNS):
            columns = slice(first, first + _COLUMNS)
            schur[:, columns] -= coupling.T @ factor.solve(coupling[:, columns].toarray())
    mass = np.repeat(mass_kg, d)
    held = fixed.ravel()[kept]
    return CondensedSurface(
        0.5 * (schur + schur.T),
        np.where(held, np.inf, mass),
        np.where(held, 0.0, damping_1_s * mass),
    )
