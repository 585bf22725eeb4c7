"""What a contact law makes of two kinds of grain, found once for each two kinds.

Roots and quotients are what a contact costs most; those of the sizes alone are the same in every
step and the same for all grains of a sieve class.
"""

from __future__ import annotations

import numpy as np

from sandmould.compiled import njit
from sandmould.dem.contact_law import Law, pair_coefficients
from sandmould.dem.grains import Floats, Grains
from sandmould.dem.vectors import OPTIONS


@njit(**OPTIONS)
def _pair_up(radius: Floats, mass: Floats, law: Law, coefficients: Floats) -> None:
    for i in range(len(radius)):
        for j in range(len(radius)):
            r_i, r_j, m_i, m_j = radius[i], radius[j], mass[i], mass[j]
            of_two = pair_coefficients(
                law, m_i * m_j / (m_i + m_j), min(r_i, r_j), r_i * r_j / (r_i + r_j)
            )
            # One by one: a row at once takes three seconds longer to compile.
            for k in range(len(of_two)):
                coefficients[i, j, k] = of_two[k]


def pair_up(grains: Grains, law: Law) -> Floats:
    """What each two of k kinds make of each other, (k, k, 3) float64.

    The fields of ``PairCoefficients``.
    """
    kinds = len(grains.radius_of)
    coefficients = np.zeros((kinds, kinds, 3))
    _pair_up(grains.radius_of, grains.mass_of, law, coefficients)
    return coefficients
