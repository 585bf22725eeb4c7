"""Forces and tangent of elements in large displacements; small ones are in ``weak_forms``.

Total Lagrangian form with the law of St. Venant and Kirchhoff (Bonet and Wood, Nonlinear Continuum
Mechanics for Finite Element Analysis, 2nd ed., sections 8 and 9): everything is integrated over
the drawing. At rest its tangent is the stiffness of linear elasticity.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from sandmould.pattern_fe.inner_forces import inner_forces
from sandmould.pattern_fe.material import Foam
from sandmould.pattern_fe.space import Space

Array = NDArray[np.float64]


def displacement_gradient(space: Space, displacement_m: Array) -> Array:
    """Grad u at the integration points; F = 1 + grad u, (ne, q, d, d) float64.

    ``displacement_m``: (n, d) float64, m.
    """
    moved = displacement_m[space.cells].transpose(0, 2, 1)[:, None]
    return np.asarray(moved @ space.gradient)


def small_strain(slope: Array) -> Array:
    """Symmetric part of grad u, (..., d, d) float64."""
    return np.asarray(0.5 * (slope + np.swapaxes(slope, -1, -2)))


def green_strain(slope: Array) -> Array:
    """E = (F^T F - 1)/2, none under any rotation, without loss of digits where it is small."""
    return np.asarray(small_strain(slope) + 0.5 * (np.swapaxes(slope, -1, -2) @ slope))


def internal_force_n(space: Space, foam: Foam, displacement_m: Array) -> Array:
    """Forces with which the nodes must be held in a deformed state, (n, d) float64, N.

    ``displacement_m``: (n, d) float64, m.
    """
    moved = np.ascontiguousarray(displacement_m, dtype=np.float64)
    lam, mu = foam.lame_pa
    return inner_forces(space.cells, space.gradient, space.weight, moved, lam, mu)


def element_tangent_n_m(space: Space, foam: Foam, displacement_m: Array) -> Array:
    """Change of the elements' forces with their displacements, (ne, k d, k d) float64, N/m.

    ``displacement_m``, (n, d) float64, m: state about which they change.
    """
    lam, mu = foam.lame_pa
    ne, _, k, d = space.gradient.shape
    slope = displacement_gradient(space, displacement_m)
    deformation = np.eye(d) + slope
    stress = foam.stress_pa(green_strain(slope))
    weight = space.weight[..., None, None]
    # column (a, i) of `along`: i-th component of F times the gradient of shape function a
    along = space.gradient @ np.swapaxes(deformation, -1, -2)
    along = along.reshape(ne, -1, k * d)
    pairs = np.swapaxes(along * space.weight[..., None], 1, 2) @ along
    pairs = pairs.reshape(ne, k, d, k, d)
    crossed = pairs.transpose(0, 1, 4, 3, 2)
    # (F F^T)_ij grad a . grad b, one column of F at a time to save memory
    stretched = np.zeros_like(pairs).reshape(ne, k * d, k * d)
    scale = np.repeat(space.weight, d, axis=1)[:, None]
    for column in np.moveaxis(deformation, -1, 0):
        rows = column[:, :, None, :, None] * space.gradient[:, :, :, None, :]
        rows = rows.transpose(0, 2, 3, 1, 4).reshape(ne, k * d, -1)
        stretched += (rows * scale) @ np.swapaxes(rows, 1, 2)
    loaded = (space.gradient @ (stress * weight) @ np.swapaxes(space.gradient, -1, -2)).sum(axis=1)
    geometric = loaded[:, :, None, :, None] * np.eye(d)[None, None, :, None, :]
    whole = lam * pairs + mu * (crossed + stretched.reshape(pairs.shape)) + geometric
    return np.asarray(whole.reshape(ne, k * d, k * d))


def von_mises_pa(foam: Foam, stress_pa: Array) -> Array:
    """Equivalent stress; in 2D with the stress that plane strain builds up across the plane.

    Gives (...) float64, Pa. ``stress_pa``: (..., d, d) float64, Pa.
    """
    trace = np.trace(stress_pa, axis1=-2, axis2=-1)
    across = foam.poisson * trace if stress_pa.shape[-1] == 2 else 0.0
    mean = (trace + across) / 3.0
    deviator2 = np.sum(stress_pa**2, axis=(-2, -1)) + across**2 - 3.0 * mean**2
    return np.asarray(np.sqrt(np.maximum(1.5 * deviator2, 0.0)))
