"""Particle interaction models: gradient (3), Laplacian (4) and relatives.

As printed, (3) and (4) hold (phi_i - phi_j), which turns the gradient round and makes diffusion
run backwards; here it is (phi_j - phi_i). All divide by the lattice's n0 and not by the local
n_i: so the Laplacian of the pressure stays symmetric.
"""

from __future__ import annotations

import math

import numpy as np

from sandmould.casting.mps.neighbours import Neighbours
from sandmould.casting.mps.particles import (
    DUMMY,
    FLUID,
    INLINED,
    OPTIONS,
    Floats,
    Kernel,
    Kinds,
    weight_slope,
)
from sandmould.compiled import njit

LEAST, DIFFERENCE, SUM, CORRECTED, PRINTED = range(5)
GRADIENTS = {
    "least": LEAST,
    "difference": DIFFERENCE,
    "sum": SUM,
    "corrected": CORRECTED,
    "printed": PRINTED,
}
"""Numerators of the pressure gradient at particle i:

- least: p_j - min p, the least pressure round i: pairs only repel (Koshizuka and Oka 1996);
- difference: p_j - p_i, exact for a constant field;
- sum: p_j + p_i, whose pairs cancel, so that momentum is conserved;
- corrected: p_j - p_i with the inverse moment matrix for d/n0, exact for a linear field on any
  positions (Khayyer and Gotoh 2011);
- printed: p_i - p_j, as (3) stands in the paper.
"""
SMALLEST_MOMENT = 0.02
"""Determinant of the moment matrix, 1 on the lattice, below which it is not inverted."""
WORST_FIT = 1e-3
"""Smallest over largest eigenvalue of a fit's matrix below which its particle keeps (4); 0.02 on
the lattice, less where neighbours hardly span the space."""


@njit(**INLINED)
def approach(near: Neighbours, velocity: Floats, k: int, i: int) -> float:
    """Relative velocity times distance; negative where two particles come nearer."""
    j = near.other[k]
    return (
        near.away_m[k, 0] * (velocity[j, 0] - velocity[i, 0])
        + near.away_m[k, 1] * (velocity[j, 1] - velocity[i, 1])
        + near.away_m[k, 2] * (velocity[j, 2] - velocity[i, 2])
    )


@njit(**OPTIONS)
def density_rate(kernel: Kernel, near: Neighbours, velocity: Floats) -> Floats:
    """Rate of the number density from the velocities, sum of w'(r) r_ij . u_ij / r.

    The source of higher order, HS (Khayyer and Gotoh 2009).

    Gives (n,) float64, 1/s. ``velocity``: (n, 3) float64, m/s.
    """
    rate = np.zeros(len(velocity))
    for i in range(len(velocity)):
        for k in range(near.start[i], near.start[i + 1]):
            away = near.away_m[k]
            r = math.sqrt(away[0] ** 2 + away[1] ** 2 + away[2] ** 2)
            rate[i] += weight_slope(kernel, r) / r * approach(near, velocity, k, i)
    return rate


@njit(**OPTIONS)
def divergence(kernel: Kernel, near: Neighbours, velocity: Floats) -> Floats:
    """Divergence of the velocity, d/n0 sum of r_ij . u_ij w / r^2; as ``density_rate``."""
    result = np.zeros(len(velocity))
    factor = kernel.dimension / kernel.lattice_density
    for i in range(len(velocity)):
        for k in range(near.start[i], near.start[i + 1]):
            result[i] += factor * near.share[k] * approach(near, velocity, k, i)
    return result


@njit(**OPTIONS)
def laplacian(kernel: Kernel, near: Neighbours, field: Floats, kind: Kinds) -> Floats:
    """Laplacian of a vector field at the fluid's particles, eq. (4) with its sign turned.

    Gives (n, 3) float64, the field's unit over m2; 0 on walls and dummies. ``field``,
    (n, 3) float64: also on walls and dummies. ``kind``: (n,) int8.
    """
    result = np.zeros_like(field)
    factor = 2.0 * kernel.dimension / kernel.lattice_density
    for i in range(len(field)):
        if kind[i] == FLUID:
            for k in range(near.start[i], near.start[i + 1]):
                j = near.other[k]
                for a in range(3):
                    result[i, a] += factor * near.share[k] * (field[j, a] - field[i, a])
    return result


@njit(**OPTIONS)
def least_around(near: Neighbours, pressure: Floats, kind: Kinds) -> Floats:
    """Least pressure of each fluid particle and its neighbours, dummies left out, Pa."""
    least = pressure.copy()
    for i in range(len(pressure)):
        if kind[i] == FLUID:
            for k in range(near.start[i], near.start[i + 1]):
                j = near.other[k]
                if kind[j] != DUMMY and pressure[j] < least[i]:
                    least[i] = pressure[j]
    return least


@njit(**OPTIONS)
def _gradient(kernel: Kernel, near: Neighbours, pressure: Floats, kind: Kinds, form: int) -> Floats:
    """As ``pressure_gradient``, before any correction."""
    result = np.zeros((len(pressure), 3))
    factor = kernel.dimension / kernel.lattice_density
    least = least_around(near, pressure, kind) if form == LEAST else pressure
    for i in range(len(pressure)):
        if kind[i] != FLUID:
            continue
        for k in range(near.start[i], near.start[i + 1]):
            j = near.other[k]
            if kind[j] == DUMMY:
                continue
            if form == LEAST:
                part = pressure[j] - least[i]
            elif form == SUM:
                part = pressure[j] + pressure[i]
            elif form == PRINTED:
                part = pressure[i] - pressure[j]
            else:
                part = pressure[j] - pressure[i]
            for a in range(3):
                result[i, a] += factor * part * near.share[k] * near.away_m[k, a]
    return result


@njit(**OPTIONS)
def _moments(kernel: Kernel, near: Neighbours, kind: Kinds) -> Floats:
    """Matrices that differences multiply a linear field's gradient by, (n, 3, 3) float64."""
    moment = np.zeros((len(kind), 3, 3))
    factor = kernel.dimension / kernel.lattice_density
    for i in range(len(kind)):
        if kind[i] != DUMMY:
            for k in range(near.start[i], near.start[i + 1]):
                if kind[near.other[k]] != DUMMY:
                    for a in range(3):
                        for b in range(3):
                            both = near.away_m[k, a] * near.away_m[k, b]
                            moment[i, a, b] += factor * near.share[k] * both
    return moment


def _corrected(kernel: Kernel, near: Neighbours, kind: Kinds, gradient: Floats) -> Floats:
    """Gradients exact for linear fields from those of differences, (n, 3, fields) float64."""
    moment = _moments(kernel, near, kind)
    if kernel.dimension == 2:
        moment[:, 2, 2] = 1.0
    # where too few neighbours span the space, the uncorrected gradient stays
    moment[np.linalg.det(moment) < SMALLEST_MOMENT] = np.eye(3)
    return np.asarray(np.linalg.solve(moment, gradient), dtype=np.float64)


def pressure_gradient(
    kernel: Kernel, near: Neighbours, pressure: Floats, kind: Kinds, form: str
) -> Floats:
    """Gradient of the pressure at the fluid's particles, eq. (3), (n, 3) float64, Pa/m.

    0 on walls and dummies.

    Parameters
    ----------
    pressure : (n,) float64, Pa
        Of fluid and walls; dummies have none.
    kind : (n,) int8
    form : str
        One of ``GRADIENTS``.
    """
    gradient = _gradient(kernel, near, pressure, kind, GRADIENTS[form])
    if form != "corrected":
        return gradient
    return _corrected(kernel, near, kind, gradient[:, :, None])[:, :, 0]


@njit(**OPTIONS)
def _velocity_differences(
    kernel: Kernel, near: Neighbours, velocity: Floats, kind: Kinds
) -> Floats:
    """As ``velocity_gradient``, before correction."""
    result = np.zeros((len(kind), 3, 3))
    factor = kernel.dimension / kernel.lattice_density
    for i in range(len(kind)):
        for k in range(near.start[i], near.start[i + 1]):
            j = near.other[k]
            if kind[j] != DUMMY:
                for a in range(3):
                    along = factor * near.share[k] * near.away_m[k, a]
                    for b in range(3):
                        result[i, a, b] += along * (velocity[j, b] - velocity[i, b])
    return result


def velocity_gradient(kernel: Kernel, near: Neighbours, velocity: Floats, kind: Kinds) -> Floats:
    """Gradient of the velocity, exact for a linear one on any positions, d u_b / d x_a.

    As the corrected gradient of the pressure; dummies are left out.

    Gives (n, 3, 3) float64, 1/s; at [i, a, b]; 0 on dummies. ``velocity``: (n, 3) float64, m/s;
    ``kind``: (n,) int8.
    """
    return _corrected(kernel, near, kind, _velocity_differences(kernel, near, velocity, kind))


@njit(**OPTIONS)
def crowding(kernel: Kernel, near: Neighbours, kind: Kinds) -> Floats:
    """Gradient of the concentration of particles, d/n0 sum of r_ij w / r^2; 0 on a lattice.

    Gives (n, 3) float64, 1/m; 0 on walls and dummies, which count as neighbours. ``kind``:
    (n,) int8.
    """
    result = np.zeros((len(kind), 3))
    factor = kernel.dimension / kernel.lattice_density
    for i in range(len(kind)):
        if kind[i] == FLUID:
            for k in range(near.start[i], near.start[i + 1]):
                for a in range(3):
                    result[i, a] += factor * near.share[k] * near.away_m[k, a]
    return result


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
