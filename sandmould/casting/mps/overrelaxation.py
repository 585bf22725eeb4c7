"""SciPy's conjugate gradients with symmetric overrelaxation, for systems of a unit diagonal.

Eisenstat's form (1981) of the preconditioner costs nothing: each iteration is one sweep down and
one up, as many operations as one product with the matrix. It needs fewer iterations than Jacobi's
preconditioner (docs/metal_flow.md counts both), and so fewer calls of SciPy, where a system of a
thousand unknowns spends most.
"""

from __future__ import annotations

from functools import partial
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray
from scipy.sparse.linalg import LinearOperator, cg

from sandmould.arrays import Floats, Ints
from sandmould.casting.mps.weight import INLINED, OPTIONS
from sandmould.compiled import njit

RELAXATION = 1.5
MOST_ITERATIONS = 2000


class System(NamedTuple):
    """A symmetric positive matrix of unit diagonal, which is not stored."""

    start: Ints
    """(m + 1,) int64: entries of row q are start[q] to start[q + 1]."""
    middle: Ints
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


@njit(**OPTIONS)
def _product(system: System, direction: Floats) -> Floats:
    """K^-1 A K'^-1 times a direction: A = K + K' + 1 - 2 / RELAXATION, K = 1 / RELAXATION + L."""
    inner, product = np.empty_like(direction), np.empty_like(direction)
    _sweep_up(system, direction, inner)
    _sweep_down(system, direction + (1.0 - 2.0 / RELAXATION) * inner, product)
    return product + inner


@njit(**OPTIONS)
def _begun(system: System, right: Floats, guess: Floats) -> tuple[Floats, Floats]:
    """K^-1 of the right-hand side and of what a guess leaves of it."""
    left, wanted, rest = np.empty_like(right), np.empty_like(right), np.empty_like(right)
    for q in range(len(right)):
        total = right[q] - guess[q]
        for k in range(system.start[q], system.start[q + 1]):
            total -= system.value[k] * guess[system.column[k]]
        left[q] = total
    _sweep_down(system, right, wanted)
    _sweep_down(system, left, rest)
    return wanted, rest


@njit(**OPTIONS)
def _added(system: System, begin: Floats, solution: Floats) -> Floats:
    """What the iteration began with and, by K'^-1, what it found."""
    step = np.empty_like(solution)
    _sweep_up(system, solution, step)
    return begin + step


def solve(
    system: System, right: Floats, guess: Floats, tolerance: float
) -> tuple[Floats, int, bool]:
    """Solve a system, or, if it is singular, find a solution where there is one.

    Parameters
    ----------
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
    wanted, rest = _begun(system, right, guess)
    size, begin = float(np.linalg.norm(wanted)), guess
    if not float(np.linalg.norm(rest)) < size:
        begin, rest = np.zeros_like(right), wanted
    m = len(right)
    operator = LinearOperator((m, m), matvec=partial(_product, system), dtype=np.float64)
    iterations = 0

    def count(_: Floats) -> None:
        nonlocal iterations
        iterations += 1

    solution, left = cg(
        operator, rest, rtol=0.0, atol=tolerance * size, maxiter=MOST_ITERATIONS, callback=count
    )
    return _added(system, begin, solution), iterations, left == 0
