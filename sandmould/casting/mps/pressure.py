"""The Poisson equation for the pressure, eq. (6), as a sparse symmetric system.

It is solved by SciPy's conjugate gradients with symmetric overrelaxation. Eisenstat's form (1981)
of the preconditioner costs nothing: each iteration is one sweep down and one up, as many operations
as one product with the matrix. It needs fewer iterations than Jacobi's preconditioner
(docs/metal_flow.md counts both), and so fewer calls of SciPy, where a system of a thousand unknowns
spends most.
"""

from __future__ import annotations

import math
from functools import partial
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray
from scipy.sparse import csr_array
from scipy.sparse.csgraph import connected_components
from scipy.sparse.linalg import LinearOperator, cg

from sandmould.arrays import Flags, Floats, Ints
from sandmould.casting.mps.neighbours import Neighbours
from sandmould.casting.mps.particles import DUMMY, INLINED, OPTIONS, Kernel, Kinds
from sandmould.compiled import njit

Flags = Flags
Numbers = Ints

CLOSED_COMPRESSION = 0.1
"""Mean excess of number density in a region without free surface beyond which it is refused: no
pressure can undo it. Disorder alone, at the same volume, makes a few percent."""
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


class ClosedRegionError(ArithmeticError):
    """Fluid without a free surface has more or fewer particles than its space."""


class NotSolvedError(ArithmeticError):
    """The pressure did not converge."""


class Rows(NamedTuple):
    """Minus the Laplacian between the particles of unknown pressure."""

    number: Numbers
    """(m,) int64: these particles."""
    scale: Floats
    """(m,) float64, m: one over the root of the diagonal, by which rows and columns are scaled."""
    closed: Flags
    """(m,) bool: not joined, over any number of neighbours, to a particle at the surface."""
    system: System


@njit(**OPTIONS)
def assemble(kernel: Kernel, near: Neighbours, kind: Kinds, surface: Flags) -> Rows:
    """Build the system by eq. (4) over n0, so that it is symmetric.

    ``kind``, (n,) int8: dummies have no pressure: no flux of it into the mould. ``surface``,
    (n,) bool: where the pressure is zero.
    """
    n = len(kind)
    factor = 2.0 * kernel.dimension / kernel.lattice_density
    row = np.full(n, -1, dtype=np.int64)
    number = np.empty(n, dtype=np.int64)
    scale = np.empty(n)
    opened = np.zeros(n, dtype=np.bool_)
    m = most = 0
    for i in range(n):
        if kind[i] == DUMMY or surface[i]:
            continue
        total = 0.0
        for k in range(near.start[i], near.start[i + 1]):
            if kind[near.other[k]] != DUMMY:
                total += factor * near.share[k]
                opened[m] |= surface[near.other[k]]
        if total > 0.0:
            row[i] = m
            number[m] = i
            scale[m] = 1.0 / math.sqrt(total)
            most += near.start[i + 1] - near.start[i]
            m += 1
    start = np.zeros(m + 1, dtype=np.int64)
    middle = np.empty(m, dtype=np.int64)
    column = np.empty(most, dtype=np.uint32)
    value = np.empty(most)
    e = 0
    for q in range(m):
        i = number[q]
        middle[q] = e
        for k in range(near.start[i], near.start[i + 1]):
            c = row[near.other[k]]
            if c >= 0:
                column[e] = c
                value[e] = -factor * near.share[k] * scale[q] * scale[c]
                e += 1
                middle[q] += c < q
        start[q + 1] = e
    system = System(start, middle, column[:e], value[:e])
    _spread(system, opened[:m])
    return Rows(number[:m], scale[:m], ~opened[:m], system)


@njit(**OPTIONS)
def _spread(system: System, reached: Flags) -> None:
    """Mark all that is joined to what is marked."""
    waiting = np.empty(len(reached), dtype=np.int64)
    count = 0
    for q in range(len(reached)):
        if reached[q]:
            waiting[count] = q
            count += 1
    done = 0
    while done < count:
        q = waiting[done]
        done += 1
        for k in range(system.start[q], system.start[q + 1]):
            c = system.column[k]
            if not reached[c]:
                reached[c] = True
                waiting[count] = c
                count += 1


def solve_pressure(
    kernel: Kernel,
    near: Neighbours,
    kind: Kinds,
    surface: Flags,
    source: Floats,
    guess: Floats,
    tolerance: float,
) -> tuple[Floats, int]:
    """Solve for the pressure by conjugate gradients.

    In a region without free surface the pressure is known but for a constant, and only the part of
    the source that sums to zero can be met: the constant is chosen to make the least pressure 0.

    Parameters
    ----------
    kernel, near, kind, surface
        As ``assemble``.
    source : (n,) float64, Pa/m2
        Minus the Laplacian wanted.
    guess : (n,) float64, Pa
        Where the iteration starts.
    tolerance : float
        As ``solve``.

    Returns
    -------
    pressure : (n,) float64, Pa
        0 at the surface and on dummies.
    iterations : int

    Raises
    ------
    ClosedRegionError
        Where a region without free surface is compressed or stretched by more than
        ``CLOSED_COMPRESSION``.
    NotSolvedError
        Where the iteration does not converge.
    """
    rows = assemble(kernel, near, kind, surface)
    pressure = np.zeros(len(kind))
    wanted = rows.scale * source[rows.number]
    regions = _closed_regions(rows)
    for region in regions:
        _refuse_crowd(near.density[rows.number[region]] / kernel.lattice_density - 1.0)
        null = 1.0 / rows.scale[region]
        wanted[region] -= null * float(null @ wanted[region]) / float(null @ null)
    begin = guess[rows.number] / rows.scale
    solution, iterations, met = solve(rows.system, wanted, begin, tolerance)
    if not met:
        raise NotSolvedError(
            f"the pressure of {len(wanted)} particles did not converge to {tolerance:g} "
            f"in {iterations} iterations"
        )
    solution *= rows.scale
    for region in regions:
        solution[region] -= solution[region].min()
    pressure[rows.number] = solution
    return pressure, iterations


def _refuse_crowd(compression: Floats) -> None:
    """Refuse a closed region whose particles do not fit it."""
    mean = float(compression.mean())
    if abs(mean) > CLOSED_COMPRESSION:
        raise ClosedRegionError(
            f"{len(compression)} particles without a free surface are compressed by "
            f"{100 * mean:.2g} %: no pressure can undo more than {100 * CLOSED_COMPRESSION:g} %"
        )


def _closed_regions(rows: Rows) -> list[Numbers]:
    """Rows of each region without free surface."""
    inside = np.flatnonzero(rows.closed)
    if not len(inside):
        return []
    system, m = rows.system, len(rows.number)
    matrix = csr_array((system.value, system.column, system.start), shape=(m, m))
    count, label = connected_components(matrix[inside][:, inside], directed=False)
    return [inside[label == k] for k in range(count)]
