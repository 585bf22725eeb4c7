"""The Poisson equation for the pressure, eq. (6), as a sparse symmetric system."""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np
from numba import njit
from numpy.typing import NDArray
from scipy.sparse import csr_array
from scipy.sparse.csgraph import connected_components
from scipy.sparse.linalg import cg

from sandmould.casting.mps.neighbours import Neighbours, apart
from sandmould.casting.mps.particles import DUMMY, Floats, Kinds
from sandmould.casting.mps.weight import OPTIONS, Kernel, weight

CLOSED_COMPRESSION = 0.02
"""Mean compression beyond which a region without free surface is refused: no pressure can undo
it, and the least of what a particle too many does to 50."""
MOST_ITERATIONS = 2000


class ClosedRegionError(ArithmeticError):
    """Fluid without a free surface has more or fewer particles than its space."""


class NotSolvedError(ArithmeticError):
    """The pressure did not converge."""


class Rows(NamedTuple):
    """Minus the Laplacian between particles of unknown pressure, scaled to a unit diagonal."""

    number: NDArray[np.int64]
    """(m,) int64: particles whose pressure is unknown."""
    start: NDArray[np.int32]
    """(m + 1,) int32."""
    column: NDArray[np.int32]
    """(e,) int32."""
    value: Floats
    """(e,) float64."""
    scale: Floats
    """(m,) float64, m: one over the root of the diagonal before scaling."""
    closed: NDArray[np.bool_]
    """(m,) bool: not joined, over any number of neighbours, to a particle at the surface."""


@njit(**OPTIONS)
def assemble(
    kernel: Kernel, near: Neighbours, position: Floats, kind: Kinds, surface: NDArray[np.bool_]
) -> Rows:
    """Build the system by eq. (4) over n0, so that it is symmetric.

    Scaling by its diagonal is Jacobi's preconditioner, at no cost in the iteration.

    Parameters
    ----------
    kernel : Kernel
    near : Neighbours
    position : (n, 3) float64, m
    kind : (n,) int8
        Dummies have no pressure: none flows into the mould.
    surface : (n,) bool
        Where the pressure is zero.
    """
    n = len(position)
    factor = 2.0 * kernel.dimension / kernel.lattice_density
    reach2 = kernel.reach_m**2
    row = np.full(n, -1, dtype=np.int32)
    number = np.empty(n, dtype=np.int64)
    m = most = 0
    for i in range(n):
        if kind[i] != DUMMY and not surface[i]:
            row[i] = m
            number[m] = i
            m += 1
            most += near.start[i + 1] - near.start[i] + 1
    start = np.zeros(m + 1, dtype=np.int32)
    column = np.empty(most, dtype=np.int32)
    value = np.empty(most)
    scale = np.empty(m)
    opened = np.zeros(m, dtype=np.bool_)
    e = 0
    for q in range(m):
        i = number[q]
        diagonal_at, total = e, 0.0
        column[e] = q
        e += 1
        for k in range(near.start[i], near.start[i + 1]):
            j = near.other[k]
            if kind[j] == DUMMY:
                continue
            _, _, _, r2 = apart(kernel, position, i, j)
            if r2 < reach2:
                part = factor * weight(kernel, math.sqrt(r2)) / r2
                total += part
                if row[j] >= 0:
                    column[e] = row[j]
                    value[e] = -part
                    e += 1
                else:
                    opened[q] = True
        value[diagonal_at] = total
        scale[q] = 1.0 / math.sqrt(total) if total > 0.0 else 0.0
        start[q + 1] = e
    for q in range(m):
        for k in range(start[q], start[q + 1]):
            value[k] *= scale[q] * scale[column[k]]
    _spread(start, column, opened)
    return Rows(number[:m], start, column[:e], value[:e], scale, ~opened)


@njit(**OPTIONS)
def _spread(start: NDArray[np.int32], column: NDArray[np.int32], reached: NDArray[np.bool_]) -> None:
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
        for k in range(start[q], start[q + 1]):
            c = column[k]
            if not reached[c]:
                reached[c] = True
                waiting[count] = c
                count += 1


class Solution(NamedTuple):
    """Pressure and what it took."""

    pressure_pa: Floats
    """(n,) float64, Pa; 0 at the surface and on dummies."""
    iterations: int


def solve_pressure(
    kernel: Kernel,
    near: Neighbours,
    position_m: Floats,
    kind: Kinds,
    surface: NDArray[np.bool_],
    source: Floats,
    tolerance: float,
    compression: Floats,
) -> Solution:
    """Solve for the pressure by conjugate gradients.

    In a region without free surface the pressure is known but for a constant, and only the part of
    the source that sums to zero can be met: the constant is chosen to make the least pressure 0.

    Parameters
    ----------
    kernel, near, position_m, kind, surface
        As ``assemble``.
    source : (n,) float64, Pa/m2
        Minus the Laplacian wanted.
    tolerance : float
        Residual over the source, both in the Euclidean norm of the scaled system.
    compression : (n,) float64
        (n_i - n0)/n0.

    Raises
    ------
    ClosedRegionError
        Where a region without free surface is compressed or stretched by more than
        ``CLOSED_COMPRESSION``.
    NotSolvedError
        After ``MOST_ITERATIONS``.
    """
    rows = assemble(kernel, near, position_m, kind, surface)
    pressure = np.zeros(len(position_m))
    if not len(rows.number):
        return Solution(pressure, 0)
    m = len(rows.number)
    matrix = csr_array((rows.value, rows.column, rows.start), shape=(m, m))
    wanted = rows.scale * source[rows.number]
    regions = _closed_regions(matrix, rows.closed)
    for region in regions:
        mean = float(compression[rows.number[region]].mean())
        if abs(mean) > CLOSED_COMPRESSION:
            raise ClosedRegionError(
                f"{len(region)} particles without a free surface are compressed by "
                f"{100 * mean:.2g} %: no pressure can undo more than "
                f"{100 * CLOSED_COMPRESSION:g} %"
            )
        null = 1.0 / np.where(rows.scale[region] > 0.0, rows.scale[region], 1.0)
        wanted[region] -= null * float(null @ wanted[region]) / float(null @ null)
    count = 0

    def counted(_: Floats) -> None:
        nonlocal count
        count += 1

    found, failed = cg(matrix, wanted, rtol=tolerance, maxiter=MOST_ITERATIONS, callback=counted)
    if failed or not np.isfinite(found).all():
        raise NotSolvedError(
            f"the pressure of {m} particles did not converge to {tolerance:g} "
            f"in {MOST_ITERATIONS} iterations"
        )
    found *= rows.scale
    for region in regions:
        found[region] -= found[region].min()
    pressure[rows.number] = found
    return Solution(pressure, count)


def _closed_regions(matrix: csr_array, closed: NDArray[np.bool_]) -> list[NDArray[np.int64]]:
    """Rows of each region without free surface."""
    inside = np.flatnonzero(closed)
    if not len(inside):
        return []
    count, label = connected_components(matrix[inside][:, inside], directed=False)
    return [inside[label == k] for k in range(count)]
