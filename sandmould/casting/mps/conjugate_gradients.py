"""Conjugate gradients with symmetric overrelaxation, for systems of a unit diagonal.

Eisenstat's form (1981) of the preconditioner costs nothing: each iteration is one sweep down and
one up, as many operations as one product with the matrix. On a thousand unknowns scipy's ``cg``
took four times as long: its time goes into calls, and Jacobi's preconditioner needs twice as many.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np
from numba import njit
from numpy.typing import NDArray

from sandmould.casting.mps.particles import Floats
from sandmould.casting.mps.weight import OPTIONS

RELAXATION = 1.5
MOST_ITERATIONS = 2000


class System(NamedTuple):
    """A symmetric positive matrix of unit diagonal, which is not stored."""

    start: NDArray[np.int64]
    """(m + 1,) int64: entries of row q are start[q] to start[q + 1]."""
    middle: NDArray[np.int64]
    """(m,) int64: where the entries left of the diagonal end and those right of it begin."""
    column: NDArray[np.uint32]
    """(e,) uint32."""
    value: Floats
    """(e,) float64."""


@njit(**OPTIONS)
def _sweep_up(system: System, diagonal: float, right: Floats, out: Floats) -> None:
    """Solve (diagonal + U) out = right."""
    for q in range(len(right) - 1, -1, -1):
        total = right[q]
        for k in range(system.middle[q], system.start[q + 1]):
            total -= system.value[k] * out[system.column[k]]
        out[q] = total / diagonal


@njit(**OPTIONS)
def _sweep_down(system: System, diagonal: float, right: Floats, out: Floats) -> None:
    """Solve (diagonal + L) out = right."""
    for q in range(len(right)):
        total = right[q]
        for k in range(system.start[q], system.middle[q]):
            total -= system.value[k] * out[system.column[k]]
        out[q] = total / diagonal


@njit(**OPTIONS)
def solve(system: System, right: Floats, tolerance: float) -> tuple[Floats, int, bool]:
    """Solve a system, or, if it is singular, find a solution where there is one.

    Parameters
    ----------
    system : System
    right : (m,) float64
    tolerance : float
        Residual over right-hand side, both in the norm of the preconditioner.

    Returns
    -------
    solution : (m,) float64
    iterations : int
    met : bool
        Whether the tolerance was reached in ``MOST_ITERATIONS``.
    """
    m = len(right)
    diagonal = 1.0 / RELAXATION
    # with K = diagonal + L, A = K + K' + (1 - 2 diagonal): iterate on K^-1 A K'^-1, y = K' x
    solution = np.zeros(m)
    residual = np.empty(m)
    _sweep_down(system, diagonal, right, residual)
    norm2 = 0.0
    for q in range(m):
        norm2 += residual[q] * residual[q]
    limit = tolerance * tolerance * norm2
    direction = residual.copy()
    inner, middle, product = np.empty(m), np.empty(m), np.empty(m)
    count = 0
    while norm2 > limit and count < MOST_ITERATIONS:
        _sweep_up(system, diagonal, direction, inner)
        for q in range(m):
            middle[q] = direction[q] + (1.0 - 2.0 * diagonal) * inner[q]
        _sweep_down(system, diagonal, middle, product)
        curvature = 0.0
        for q in range(m):
            product[q] += inner[q]
            curvature += direction[q] * product[q]
        if not curvature > 0.0:
            return solution, count, False
        step = norm2 / curvature
        new2 = 0.0
        for q in range(m):
            solution[q] += step * inner[q]
            residual[q] -= step * product[q]
            new2 += residual[q] * residual[q]
        for q in range(m):
            direction[q] = residual[q] + new2 / norm2 * direction[q]
        norm2 = new2
        count += 1
    return solution, count, math.isfinite(norm2) and norm2 <= limit
