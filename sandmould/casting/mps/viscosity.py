"""Laplacian of the velocity: the paper's model (4), or a fit that is exact off the lattice."""

from __future__ import annotations

import numpy as np

from sandmould.casting.mps.neighbours import Neighbours
from sandmould.casting.mps.operators import laplacian
from sandmould.casting.mps.particles import DUMMY, FLUID, Floats, Kinds
from sandmould.casting.mps.weight import INLINED, OPTIONS, Kernel
from sandmould.compiled import njit

WORST_FIT = 1e-3
"""Smallest over largest eigenvalue of a fit's matrix below which its particle keeps (4); 0.02 on
the lattice, less where neighbours hardly span the space."""


@njit(**INLINED)
def _set_terms(kernel: Kernel, away_m: Floats, term: Floats) -> None:
    """Terms of a quadratic field at a neighbour: x, x^2/2, then the products of two axes."""
    d = kernel.dimension
    last = 2 * d
    for a in range(d):
        x = away_m[a] / kernel.spacing_m
        term[a] = x
        term[d + a] = 0.5 * x * x
        for b in range(a + 1, d):
            term[last] = x * away_m[b] / kernel.spacing_m
            last += 1


@njit(**OPTIONS)
def _fits(kernel: Kernel, near: Neighbours, field: Floats, kind: Kinds) -> tuple[Floats, Floats]:
    """Normal equations of a quadratic field round each particle, distances over the spacing."""
    d = kernel.dimension
    size = d + d * (d + 1) // 2
    matrix = np.zeros((len(kind), size, size))
    right = np.zeros((len(kind), size, 3))
    term = np.empty(size)
    for i in np.flatnonzero(kind == FLUID):
        for k in range(near.start[i], near.start[i + 1]):
            j = near.other[k]
            # an unknown value weighs nothing
            share = near.share[k] * kernel.spacing_m**2 * (kind[j] != DUMMY)
            _set_terms(kernel, near.away_m[k], term)
            for a in range(size):
                for b in range(size):
                    matrix[i, a, b] += share * term[a] * term[b]
                for b in range(3):
                    right[i, a, b] += share * term[a] * (field[j, b] - field[i, b])
    return matrix, right


def fitted_laplacian(kernel: Kernel, near: Neighbours, field: Floats, kind: Kinds) -> Floats:
    """Laplacian by least squares, exact for a quadratic field on any positions.

    After Tamai and Koshizuka (2014), without the derivative's own weight. Dummies are left out:
    they carry the mould's velocity, which does not go on beyond its surface. Arguments and result
    as ``laplacian``; as that where too few neighbours span the space.
    """
    laplacians = laplacian(kernel, near, field, kind)
    matrix, right = _fits(kernel, near, field, kind)
    values = np.linalg.eigvalsh(matrix)
    good = values[:, 0] > WORST_FIT * values[:, -1]
    d = kernel.dimension
    fitted = np.linalg.solve(matrix[good], right[good])[:, d : 2 * d]
    laplacians[good] = fitted.sum(axis=1) / kernel.spacing_m**2
    return laplacians


LAPLACIANS = {"lattice": laplacian, "fitted": fitted_laplacian}
"""Of the velocity. ``lattice`` is (4), exact on the lattice alone: rows that slide past each other
see 4 % too little viscosity at c_k = 2.1 (mean over their phases; 1.0 % at 3.1, 0.6 % at 4)."""
