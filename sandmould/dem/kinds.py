"""Kinds of grain: what a contact law makes of two sizes is found once for each two kinds.

Roots and quotients are what a contact costs most; those of the sizes alone are the same in every
step and the same for all grains of a sieve class.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from sandmould.compiled import njit
from sandmould.dem.contact_law import Law, PairCoefficients, pair_coefficients
from sandmould.dem.grains import Floats, Grains, Ints
from sandmould.dem.vectors import INLINED, OPTIONS

MOST_KINDS = 256
"""Kinds that one byte tells apart."""


class Kinds(NamedTuple):
    """Kinds of n grains, each of one radius and one mass, and what two kinds make of each other."""

    of_grain: NDArray[np.uint8]
    """(n,) uint8."""
    coefficients: Floats
    """(k, k, 3) float64: the fields of ``PairCoefficients``."""


@njit(**OPTIONS)
def _tell_apart(radius: Floats, mass: Floats) -> tuple[NDArray[np.uint8], Ints]:
    """Kind of each grain, in the order they first appear, and the first grain of each kind."""
    of_grain = np.zeros(len(radius), dtype=np.uint8)
    example = np.empty(MOST_KINDS, dtype=np.int64)
    kinds = 0
    for i in range(len(radius)):
        kind = 0
        while kind < kinds and (
            radius[example[kind]] != radius[i] or mass[example[kind]] != mass[i]
        ):
            kind += 1
        if kind == MOST_KINDS:
            return of_grain, example[:0]
        if kind == kinds:
            example[kind] = i
            kinds += 1
        of_grain[i] = kind
    return of_grain, example[:kinds]


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


def find_kinds(grains: Grains, law: Law) -> Kinds:
    """Tell kinds of grain apart.

    Parameters
    ----------
    grains : Grains
    law : Law
        Of two grains.

    Raises
    ------
    ValueError
        Of more than ``MOST_KINDS`` kinds.
    """
    of_grain, example = _tell_apart(grains.radius, grains.mass)
    if len(grains.id) and not len(example):
        raise ValueError(f"grains of more than {MOST_KINDS} radii and masses; use size classes")
    coefficients = np.zeros((len(example), len(example), 3))
    _pair_up(grains.radius[example], grains.mass[example], law, coefficients)
    return Kinds(of_grain, coefficients)
