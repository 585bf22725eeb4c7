"""Forces of elements in large displacements, compiled: Newton's method needs many."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
from numpy.typing import NDArray

from sandmould.compiled import njit

Array = NDArray[np.float64]
Indices = NDArray[np.int64]


def _compiled(d: int) -> Callable[..., Array]:
    """Build the loop for a number of dimensions, which as a constant makes it twice as fast."""

    def inner_forces(
        cells: Indices, gradient: Array, weight: Array, displacement: Array, lam: float, mu: float
    ) -> Array:
        ne, points, k, _ = gradient.shape
        force = np.zeros_like(displacement)
        slope, stress, piola = np.empty((d, d)), np.empty((d, d)), np.empty((d, d))
        for e in range(ne):
            for q in range(points):
                for i in range(d):
                    for j in range(d):
                        total = 0.0
                        for a in range(k):
                            total += displacement[cells[e, a], i] * gradient[e, q, a, j]
                        slope[i, j] = total
                trace = 0.0
                for i in range(d):
                    for j in range(d):
                        # of the Green strain, without the 1 of F, which would cost digits
                        twice = slope[i, j] + slope[j, i]
                        for m in range(d):
                            twice += slope[m, i] * slope[m, j]
                        stress[i, j] = mu * twice
                        if i == j:
                            trace += 0.5 * twice
                for i in range(d):
                    stress[i, i] += lam * trace
                for i in range(d):
                    for j in range(d):
                        total = stress[i, j]
                        for m in range(d):
                            total += slope[i, m] * stress[m, j]
                        piola[i, j] = total * weight[e, q]
                for a in range(k):
                    for i in range(d):
                        total = 0.0
                        for j in range(d):
                            total += piola[i, j] * gradient[e, q, a, j]
                        force[cells[e, a], i] += total
        return force

    # Kept machine code is found by this name: with one name the two could be taken for each other.
    inner_forces.__qualname__ = f"inner_forces_{d}d"
    return njit()(inner_forces)


_BY_DIMENSION = {2: _compiled(2), 3: _compiled(3)}


def inner_forces(
    cells: Indices, gradient: Array, weight: Array, displacement: Array, lam: float, mu: float
) -> Array:
    """Sum the integrals of P grad N over elements, P = F (lam tr(E) 1 + 2 mu E), (n, d) float64, N.

    Parameters
    ----------
    cells : (ne, k) int64
    gradient : (ne, q, k, d) float64, 1/m
    weight : (ne, q) float64, m3
    displacement : (n, d) float64, m
    lam, mu : float, Pa
    """
    compiled = _BY_DIMENSION[gradient.shape[3]]
    return compiled(cells, gradient, weight, displacement, lam, mu)
