"""Masses of a condensed pattern that bear the step of the grains and leave its bending alone.

A mass in proportion to the stiffness weighs on the fast, local motions of the surface, which are
what a step and a single contact throw, and hardly on the slow bending (Olovsson, Simonsson and
Unosson, International Journal for Numerical Methods in Engineering 63, 2005). Diagonal masses
large enough for the same contacts would slow the bending as much as the rest.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from sandmould.pattern_fe.condensation import CondensedSurface
from sandmould.pattern_fe.coupling.contact_rows import ContactRows

Array = NDArray[np.float64]
STABLE_SHARE = 0.8
"""Of what central differences bear; the grains in contact bear the rest."""
SLOWED = 0.01
"""Share by which the mass that goes with the stiffness may lower the first frequency."""
LIKE_FOAM = 0.9
"""Ratio of the first frequency to that of the scaled masses alone that a given scale must leave."""
_PART = 1e-5
"""Least part that the elastic force has in M u / omega^-2."""
_NEAR = 1.001
"""Ratio to which a least number is found."""


@dataclass(frozen=True)
class SelectiveMass:
    """M = s M0 + S / omega^2 of a condensed pattern, seen in its own modes."""

    scale: float
    """s, factor of the pattern's own masses."""
    omega_1_s: float
    """omega, above all frequencies of the pattern so scaled."""
    square_1_s2: Array
    shape: Array
    """Of the pattern's own masses; see ``CondensedSurface.modes``."""

    @property
    def first_hz(self) -> float:
        """Lowest natural frequency, of a motion that bends the pattern where nothing holds it."""
        own = _first(self.square_1_s2)
        return math.sqrt(own / (self.scale + own / self.omega_1_s**2)) / (2.0 * math.pi)

    @property
    def own_first_hz(self) -> float:
        """Lowest natural frequency with the pattern's own masses."""
        return math.sqrt(_first(self.square_1_s2)) / (2.0 * math.pi)

    def inverse_1_kg(self) -> Array:
        """Inverse of M, (n, n) float64, 1/kg; rows and columns of held components are 0."""
        modal = self.scale + self.square_1_s2 / self.omega_1_s**2
        return np.asarray((self.shape / modal) @ self.shape.T)


def selective_mass(
    surface: CondensedSurface, contacts: ContactRows, step_s: float, scale: float | None = None
) -> SelectiveMass:
    """Find the least masses that bear a step and the contacts.

    ``surface``: with the pattern's own masses. ``scale``: factor of the pattern's own masses,
    raised to the least that leaves ``LIKE_FOAM`` of the first frequency to them; unless given the
    least from 1 on that leaves ``1 - SLOWED``.

    Raises
    ------
    ValueError
        When a given scale is not positive.
    """
    if scale is not None and not 0.0 < scale < math.inf:
        raise ValueError(f"mass scale of the pattern is {scale:g}, valid is above 0")
    square, shape = surface.modes
    first = _first(square)
    rows = [shape.T @ row @ shape for row in contacts.row_kg]

    def bears(scale: float, share_s2: float) -> bool:
        """Whether contacts and step stay within the share, with S times share_s2 in M."""
        modal = scale + share_s2 * square
        left = STABLE_SHARE - float((0.25 * step_s**2 * square / modal).max())
        left -= contacts.one_kg * float(((shape**2) / modal).sum(axis=1).max())
        return left > 0.0 and all(_positive(np.diag(left * modal) - row) for row in rows)

    slowed = 2.0 * SLOWED if scale is None else LIKE_FOAM**-2 - 1.0

    def leaves_bending(scale: float) -> bool:
        most_s2 = slowed * scale / first
        return most_s2 > step_s**2 and bears(scale, most_s2)

    chosen = _least(leaves_bending, 1.0 if scale is None else scale)
    # the elastic force is found as a part of M u: not so small a part that its digits are lost
    least_s2 = max(step_s**2, _PART * chosen / first)
    share_s2 = _least(lambda share_s2: bears(chosen, share_s2), least_s2)
    return SelectiveMass(chosen, 1.0 / math.sqrt(share_s2), square, shape)


def _first(square_1_s2: Array) -> float:
    return float(square_1_s2[square_1_s2 > 0.0].min())


def _least(holds: Callable[[float], bool], low: float) -> float:
    """Least number from a positive one on for which something holds that then goes on to hold."""
    if holds(low):
        return low
    high = 4.0 * low
    while not holds(high):
        low, high = high, 4.0 * high
    while high > _NEAR * low:
        middle = math.sqrt(low * high)
        low, high = (low, middle) if holds(middle) else (middle, high)
    return high


def _positive(matrix: Array) -> bool:
    try:
        np.linalg.cholesky(matrix)
    except np.linalg.LinAlgError:
        return False
    return True
