"""Particle interaction models: number density (2), gradient (3), Laplacian (4) and relatives.

As printed, (3) and (4) hold (phi_i - phi_j), which turns the gradient round and makes diffusion
run backwards; here it is (phi_j - phi_i). All divide by the lattice's n0 and not by the local
n_i: so the Laplacian of the pressure stays symmetric.
"""

from __future__ import annotations

import math
from typing import Any

import numpy as np
from numba import njit
from numpy.typing import NDArray

from sandmould.casting.mps.neighbours import Neighbours, apart
from sandmould.casting.mps.particles import DUMMY, FLUID, Floats, Kinds
from sandmould.casting.mps.weight import INLINED, OPTIONS, Kernel, weight, weight_slope

LEAST, DIFFERENCE, SUM, CONSERVATIVE, CORRECTED, PRINTED = range(6)
GRADIENTS = {
    "least": LEAST,
    "difference": DIFFERENCE,
    "sum": SUM,
    "conservative": CONSERVATIVE,
    "corrected": CORRECTED,
    "printed": PRINTED,
}
"""Numerators of the pressure gradient at particle i:

- least: p_j - min p, the least pressure round i: pairs only repel (Koshizuka and Oka 1996);
- difference: p_j - p_i, exact for a constant field;
- sum: p_j + p_i, whose pairs cancel, so that momentum is conserved;
- conservative: p_i + p_j - min p_i - min p_j, CMPS (Khayyer and Gotoh 2008): cancels as well;
- corrected: p_j - p_i with the inverse moment matrix for d/n0, exact for a linear field on any
  positions (Khayyer and Gotoh 2011);
- printed: p_i - p_j, as (3) stands in the paper.
"""


@njit(**OPTIONS)
def number_density(kernel: Kernel, near: Neighbours, position: Floats, kind: Kinds) -> Floats:
    """Number density of fluid and walls, eq. (2); 0 for dummies.

    Parameters
    ----------
    kernel : Kernel
    near : Neighbours
    position : (n, 3) float64, m
    kind : (n,) int8

    Returns
    -------
    (n,) float64
    """
    density = np.zeros(len(position))
    reach2 = kernel.reach_m**2
    for i in range(len(position)):
        if kind[i] == DUMMY:
            continue
        total = 0.0
        for k in range(near.start[i], near.start[i + 1]):
            _, _, _, r2 = apart(kernel, position, i, near.other[k])
            if r2 < reach2:
                total += weight(kernel, math.sqrt(r2))
        density[i] = total
    return density


@njit(**OPTIONS)
def density_rate(
    kernel: Kernel, near: Neighbours, position: Floats, velocity: Floats, kind: Kinds
) -> Floats:
    """Rate of the number density from the velocities, sum of w'(r) r_ij . u_ij / r, 1/s.

    The source of higher order, HS (Khayyer and Gotoh 2009); arguments as ``number_density``.
    """
    rate = np.zeros(len(position))
    reach2 = kernel.reach_m**2
    for i in range(len(position)):
        if kind[i] == DUMMY:
            continue
        for k in range(near.start[i], near.start[i + 1]):
            j = near.other[k]
            dx, dy, dz, r2 = apart(kernel, position, i, j)
            if r2 < reach2:
                r = math.sqrt(r2)
                rate[i] += weight_slope(kernel, r) / r * _approach(velocity, i, j, dx, dy, dz)
    return rate


@njit(**OPTIONS)
def divergence(
    kernel: Kernel, near: Neighbours, position: Floats, velocity: Floats, kind: Kinds
) -> Floats:
    """Divergence of the velocity, d/n0 sum of r_ij . u_ij w / r^2, 1/s.

    Arguments as ``number_density``.
    """
    found = np.zeros(len(position))
    reach2 = kernel.reach_m**2
    factor = kernel.dimension / kernel.lattice_density
    for i in range(len(position)):
        if kind[i] == DUMMY:
            continue
        for k in range(near.start[i], near.start[i + 1]):
            j = near.other[k]
            dx, dy, dz, r2 = apart(kernel, position, i, j)
            if r2 < reach2:
                part = weight(kernel, math.sqrt(r2)) / r2
                found[i] += factor * part * _approach(velocity, i, j, dx, dy, dz)
    return found


@njit(**INLINED)
def _approach(velocity: Floats, i: int, j: int, dx: float, dy: float, dz: float) -> float:
    """Relative velocity times distance vector; negative where two particles come nearer."""
    return (
        dx * (velocity[j, 0] - velocity[i, 0])
        + dy * (velocity[j, 1] - velocity[i, 1])
        + dz * (velocity[j, 2] - velocity[i, 2])
    )


@njit(**OPTIONS)
def laplacian(
    kernel: Kernel, near: Neighbours, position: Floats, field: Floats, kind: Kinds
) -> Floats:
    """Laplacian of a vector field at the fluid's particles, eq. (4) with its sign turned.

    Parameters
    ----------
    kernel : Kernel
    near : Neighbours
    position : (n, 3) float64, m
    field : (n, 3) float64
        Also on walls and dummies.
    kind : (n,) int8

    Returns
    -------
    (n, 3) float64, the field's unit over m2
        0 on walls and dummies.
    """
    found = np.zeros_like(field)
    reach2 = kernel.reach_m**2
    factor = 2.0 * kernel.dimension / kernel.lattice_density
    for i in range(len(position)):
        if kind[i] != FLUID:
            continue
        for k in range(near.start[i], near.start[i + 1]):
            j = near.other[k]
            _, _, _, r2 = apart(kernel, position, i, j)
            if r2 < reach2:
                part = factor * weight(kernel, math.sqrt(r2)) / r2
                for a in range(3):
                    found[i, a] += part * (field[j, a] - field[i, a])
    return found


@njit(**OPTIONS)
def least_around(
    kernel: Kernel, near: Neighbours, position: Floats, pressure: Floats, kind: Kinds
) -> Floats:
    """Least pressure of a particle and its neighbours that have one; as ``pressure_gradient``."""
    least = pressure.copy()
    reach2 = kernel.reach_m**2
    for i in range(len(position)):
        if kind[i] != FLUID:
            continue
        for k in range(near.start[i], near.start[i + 1]):
            j = near.other[k]
            if kind[j] != DUMMY and pressure[j] < least[i]:
                _, _, _, r2 = apart(kernel, position, i, j)
                if r2 < reach2:
                    least[i] = pressure[j]
    return least


@njit(**OPTIONS)
def pressure_gradient(
    kernel: Kernel,
    near: Neighbours,
    position: Floats,
    pressure: Floats,
    kind: Kinds,
    form: int,
) -> Floats:
    """Gradient of the pressure at the fluid's particles, eq. (3).

    Parameters
    ----------
    kernel : Kernel
    near : Neighbours
    position : (n, 3) float64, m
    pressure : (n,) float64, Pa
        Of fluid and walls; dummies have none.
    kind : (n,) int8
    form : int
        One of ``GRADIENTS``.

    Returns
    -------
    (n, 3) float64, Pa/m
        0 on walls and dummies.
    """
    found = np.zeros_like(position)
    reach2 = kernel.reach_m**2
    factor = kernel.dimension / kernel.lattice_density
    least = pressure
    if form == LEAST or form == CONSERVATIVE:
        least = least_around(kernel, near, position, pressure, kind)
    for i in range(len(position)):
        if kind[i] != FLUID:
            continue
        p_i, least_i = pressure[i], least[i]
        gx = gy = gz = 0.0
        for k in range(near.start[i], near.start[i + 1]):
            j = near.other[k]
            if kind[j] == DUMMY:
                continue
            dx, dy, dz, r2 = apart(kernel, position, i, j)
            if r2 >= reach2:
                continue
            p_j = pressure[j]
            if form == LEAST:
                part = p_j - least_i
            elif form == SUM:
                part = p_j + p_i
            elif form == CONSERVATIVE:
                # a wall's own least pressure is left out: it takes no part in the balance
                part = p_i + p_j - least_i - (least[j] if kind[j] == FLUID else least_i)
            elif form == PRINTED:
                part = p_i - p_j
            else:
                part = p_j - p_i
            part *= weight(kernel, math.sqrt(r2)) / r2
            gx += part * dx
            gy += part * dy
            gz += part * dz
        found[i, 0], found[i, 1], found[i, 2] = factor * gx, factor * gy, factor * gz
    if form == CORRECTED:
        _correct(kernel, near, position, kind, found)
    return found


@njit(**OPTIONS)
def _correct(
    kernel: Kernel, near: Neighbours, position: Floats, kind: Kinds, gradient: Floats
) -> None:
    """Turn uncorrected gradients into those that are exact for a linear field."""
    factor = kernel.dimension / kernel.lattice_density
    reach2 = kernel.reach_m**2
    moment = np.zeros((3, 3))
    for i in range(len(position)):
        if kind[i] != FLUID:
            continue
        moment[:] = 0.0
        for k in range(near.start[i], near.start[i + 1]):
            j = near.other[k]
            if kind[j] == DUMMY:
                continue
            dx, dy, dz, r2 = apart(kernel, position, i, j)
            if r2 < reach2:
                part = factor * weight(kernel, math.sqrt(r2)) / r2
                d = (dx, dy, dz)
                for a in range(3):
                    for b in range(3):
                        moment[a, b] += part * d[a] * d[b]
        if kernel.dimension == 2:
            moment[2, 2] = 1.0
        # where too few neighbours span the space, the plain gradient stays
        if np.linalg.det(moment) > SMALLEST_MOMENT:
            gradient[i] = np.linalg.solve(moment, gradient[i])


SMALLEST_MOMENT = 0.1
"""Determinant of the moment matrix, 1 on the lattice, below which it is not inverted."""


@njit(**OPTIONS)
def crowding(kernel: Kernel, near: Neighbours, position: Floats, kind: Kinds) -> Floats:
    """Gradient of the concentration of particles, d/n0 sum of r_ij w / r^2, 1/m; 0 on a lattice.

    Dummies count. Arguments as ``number_density``.
    """
    found = np.zeros_like(position)
    reach2 = kernel.reach_m**2
    factor = kernel.dimension / kernel.lattice_density
    for i in range(len(position)):
        if kind[i] != FLUID:
            continue
        for k in range(near.start[i], near.start[i + 1]):
            dx, dy, dz, r2 = apart(kernel, position, i, near.other[k])
            if r2 < reach2:
                part = factor * weight(kernel, math.sqrt(r2)) / r2
                found[i, 0] += part * dx
                found[i, 1] += part * dy
                found[i, 2] += part * dz
    return found
