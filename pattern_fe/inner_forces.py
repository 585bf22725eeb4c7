"""Forces of elements in large displacements, compiled: explicit motion asks for them every step."""

from __future__ import annotations

import numpy as np
from numba import njit
from numpy.typing import NDArray

Array = NDArray[np.float64]
Indices = NDArray[np.int64]


@njit(cache=True)
def inner_forces(
    cells: Indices, gradient: Array, weight: Array, displacement: Array, lam: float, mu: float
) -> Array:
    """Sum the integrals of P grad N over elements, P = F (lam tr(E) 1 + 2 mu E).

    Parameters
    ----------
    cells : (ne, k) int64
    gradient : (ne, q, k, d) float64, 1/m
    weight : (ne, q) float64, m3
    displacement : (n, d) float64, m
    lam, mu : float, Pa

    Returns
    -------
    (n, d) float64, N
    """
    ne, points, k, d = gradient.shape
    force = np.zeros_like(displacement)
    slope, stress, piola = np.empty((d, d)), np.empty((d, d)), np.empty((d, d))
    for e in range(ne):
        for q in range(points):
            slope[:] = 0.0
            for a in range(k):
                node = cells[e, a]
                for i in range(d):
                    for j in range(d):
                        slope[i, j] += displacement[node, i] * gradient[e, q, a, j]
            trace = 0.0
            for i in range(d):
                for j in range(d):
                    # twice the Green strain, without the 1 of F, which would cost digits
                    twice = slope[i, j] + slope[j, i]
                    for m in range(d):
                        twice += slope[m, i] * slope[m, j]
                    stress[i, j] = mu * twice
                trace += 0.5 * stress[i, i] / mu
            for i in range(d):
                stress[i, i] += lam * trace
            for i in range(d):
                for j in range(d):
                    piola[i, j] = stress[i, j]
                    for m in range(d):
                        piola[i, j] += slope[i, m] * stress[m, j]
                    piola[i, j] *= weight[e, q]
            for a in range(k):
                node = cells[e, a]
                for i in range(d):
                    for j in range(d):
                        force[node, i] += piola[i, j] * gradient[e, q, a, j]
    return force
