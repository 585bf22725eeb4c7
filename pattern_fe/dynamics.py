"""Masses of a pattern, its natural frequencies and the largest step of explicit integration."""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray
from scipy.sparse import csc_array, diags_array
from scipy.sparse.linalg import eigsh

from sandmould.pattern_fe.material import Foam
from sandmould.pattern_fe.space import Space
from sandmould.pattern_fe.supports import Mask
from sandmould.pattern_fe.weak_forms import element_mass_kg, element_stiffness_n_m

Array = NDArray[np.float64]


def element_lumped_mass_kg(space: Space, foam: Foam) -> Array:
    """Mass of each element shared among its nodes, (ne, k) float64, kg.

    In proportion to the diagonal of the consistent mass, which is positive in all elements,
    unlike the sum of its rows (Hinton, Rock and Zienkiewicz, Earthquake Engineering and
    Structural Dynamics 4, 1976).
    """
    products = element_mass_kg(space, foam)
    diagonal = np.einsum("eaa->ea", products)
    # shape functions sum to 1, so all products sum to the whole
    whole = products.sum(axis=(1, 2))[:, None]
    return np.asarray(whole * diagonal / diagonal.sum(axis=1, keepdims=True))


def lumped_mass_kg(space: Space, foam: Foam) -> Array:
    """Lumped mass of each node, (n,) float64, kg."""
    return space.summed(element_lumped_mass_kg(space, foam)[..., None])[:, 0]


def natural_frequencies_hz(
    space: Space, foam: Foam, stiffness: csc_array, mass: csc_array, fixed: Mask, count: int
) -> Array:
    """Lowest natural frequencies, ascending; those of rigid motions are near 0.

    Gives (count,) float64, Hz. ``stiffness``, ``mass``: (n d, n d) sparse float64, N/m and kg;
    ``fixed``: (n, d) bool.

    Raises
    ------
    ValueError
        When there are not more free components than frequencies asked for.
    """
    free = np.flatnonzero(~fixed.ravel())
    if not 0 < count < len(free):
        valid = f"1 to {len(free) - 1}"
        raise ValueError(f"number of natural frequencies is {count}, valid here is {valid}")
    # a shift below 0 keeps the factorised matrix regular when rigid motions are free
    extent = float(np.ptp(space.node_m, axis=0).max())
    shift = -1e-4 * foam.young_pa / foam.density_kg_m3 / extent**2
    start = np.random.default_rng(1).standard_normal(len(free))
    square = eigsh(
        stiffness[free][:, free],
        count,
        mass[free][:, free],
        sigma=shift,
        return_eigenvectors=False,
        v0=start,
    )
    return np.asarray(np.sqrt(np.maximum(np.sort(square), 0.0)) / (2.0 * math.pi))


def critical_step_s(space: Space, foam: Foam) -> float:
    """2/omega of the stiffest element alone, below which central differences are stable.

    No frequency of the whole exceeds the largest of its elements (Irons and Treharne; Hughes,
    The Finite Element Method, section 9.3).
    """
    stiffness = element_stiffness_n_m(space, foam)
    mass = element_lumped_mass_kg(space, foam)
    root = 1.0 / np.sqrt(np.repeat(mass, space.dimension, axis=1))
    square = np.linalg.eigvalsh(root[:, :, None] * stiffness * root[:, None, :])[:, -1]
    return 2.0 / math.sqrt(float(square.max()))


def as_diagonal(mass_kg: Array, dimension: int) -> csc_array:
    """Lumped masses of nodes as a matrix of all components, (n d, n d) sparse, kg."""
    return diags_array(np.repeat(mass_kg, dimension)).tocsc()
