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
from sandmould.casting.mps.weight import INLINED, OPTIONS

RELAXATION = 1.5
MOST_ITERATIONS = 2000


class System(NamedTuple):
    """A symmetric positive matrix of unit diagonal, which is not stored."""

    start: NDArray[np.int64]
    """(m + 1,) int64: entries of row q are start[q] to start[q + 1]."""
    middle: NDArray[np.int64]
    """(m,) int64: where the entries left of the diagonal end and those right of it begin."""
    column: NDArray[np.uint32]
    """(e,) uint32: rising within each row."""
    value: Floats
    """(e,) float64."""


@njit(**INLINED)
def _sweep_up(system: System, right: Floats, out: Floats) -> None:
    """Solve (1/RELAXATION + U) out = right, nearest columns last: they are waited for."""
    for q in range(len(right) - 1, -1, -1):
        total = right[q]
        for k in range(system.start[q + 1] - 1, system.middle[q] - 1, -1):
            total -= system.value[k] * out[system.column[k]]
        out[q] = RELAXATION * total


@njit(**INLINED)
def _sweep_down(system: System, right: Floats, out: Floats) -> None:
    """Solve (1/RELAXATION + L) out = right, likewise."""
    for q in range(len(right)):
        total = right[q]
        for k in range(system.start[q], system.middle[q]):
            total -= system.value[k] * out[system.column[k]]
        out[q] = RELAXATION * total


@njit(**INLINED)
def _norm2(values: Floats) -> float:
    total = 0.0
    for q in range(len(values)):
        total += values[q] * values[q]
    return total


@njit(**OPTIONS)
def _rest(system: System, right: Floats, solution: Floats) -> Floats:
    """What a solution leaves of the right-hand side."""
    left = np.empty(len(right))
    for q in range(len(right)):
        total = right[q] - solution[q]
        for k in range(system.start[q], system.start[q + 1]):
            total -= system.value[k] * solution[system.column[k]]
        left[q] = total
    return left


@njit(**OPTIONS)
def solve(
    system: System, right: Floats, guess: Floats, tolerance: float
) -> tuple[Floats, int, bool]:
    """Solve a system, or, if it is singular, find a solution where there is one.

    Parameters
    ----------
    system : System
    right : (m,) float64
    guess : (m,) float64
        Where the iteration starts, unless 0 leaves a smaller residual.
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
    between = 1.0 - 2.0 / RELAXATION
    # with K = diagonal + L, A = K + K' + (1 - 2 diagonal): iterate on K^-1 A K'^-1, y = K' x
    residual, direction = np.empty(m), np.empty(m)
    _sweep_down(system, right, residual)
    norm2 = _norm2(residual)
    limit = tolerance * tolerance * norm2
    _sweep_down(system, _rest(system, right, guess), direction)
    guessed2 = _norm2(direction)
    solution = np.zeros(m)
    if guessed2 < norm2:
        solution[:] = guess
        residual[:] = direction
        norm2 = guessed2
    direction[:] = residual
    inner, middle, product = np.empty(m), np.empty(m), np.empty(m)
    count = 0
    while norm2 > limit and count < MOST_ITERATIONS:
        _sweep_up(system, direction, inner)
        for q in range(m):
            middle[q] = direction[q] + between * inner[q]
        _sweep_down(system, middle, product)
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
