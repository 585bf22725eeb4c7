"""What a contact law makes of two kinds of grain, found once for each two kinds.

Roots and quotients are what a contact costs most; those of the sizes alone are the same in every
step and the same for all grains of a sieve class.
"""

from __future__ import annotations

import numpy as np

from sandmould.compiled import njit
from sandmould.dem.contact_law import Law, PairCoefficients, pair_coefficients
from sandmould.dem.grains import Floats, Grains
from sandmould.dem.vectors import INLINED, OPTIONS


@njit(**OPTIONS)
def _pair_up(radius: Floats, mass: Floats, law: Law, coefficients: Floats) -> None:
    for i in range(len(radius)):
        for j in range(len(radius)):
            r_i, r_j, m_i, m_j = radius[i], radius[j], mass[i], mass[j]
            coefficients[i, j] = pair_coefficients(
                law, m_i * m_j / (m_i + m_j), min(r_i, r_j), r_i * r_j / (r_i + r_j)
            )


@njit(**INLINED)
def pair_coefficients_of(
    coefficients: Floats, kind_1: int | np.uint64, kind_2: int | np.uint64
) -> PairCoefficients:
    """Give what two kinds make of each other."""
    return PairCoefficients(
        coefficients[kind_1, kind_2, 0],
        coefficients[kind_1, kind_2, 1],
        coefficients[kind_1, kind_2, 2],
    )


def pair_up(grains: Grains, law: Law) -> Floats:
    """What each two of k kinds make of each other.

    Parameters
    ----------
    grains : Grains
    law : Law
        Of two grains.

    Returns
    -------
    (k, k, 3) float64
        The fields of ``PairCoefficients``.
    """
    kinds = len(grains.radius_of)
    coefficients = np.zeros((kinds, kinds, 3))
    _pair_up(grains.radius_of, grains.mass_of, law, coefficients)
    return coefficients
