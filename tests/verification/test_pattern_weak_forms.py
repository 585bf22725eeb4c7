"""Matrices of the weak forms beside elements integrated by hand and scikit-fem's vector forms."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray
from skfem import Basis, ElementVector
from skfem.models.elasticity import linear_elasticity

from sandmould.pattern_fe.elasticity import element_tangent_n_m
from sandmould.pattern_fe.space import _ELEMENTS
from sandmould.pattern_fe.weak_forms import element_mass_kg, element_stiffness_n_m
from tests.patterns import KINDS, _one_thread, distorted, mesh_of_kind, pattern_of_kind  # noqa: F401

Array = NDArray[np.float64]
ROUND_OFF = 1e-12
"""Sums of some hundred products of doubles."""


def of_a_tetrahedron(corners_m: Array, lam: float, mu: float) -> Array:
    """Stiffness of a linear tetrahedron, V B^T D B with the strains of its four corners."""
    edges = (corners_m[1:] - corners_m[0]).T
    volume_m3 = abs(np.linalg.det(edges)) / 6.0
    slopes = np.linalg.inv(edges)
    slopes = np.vstack([-slopes.sum(axis=0), slopes])
    b = np.zeros((6, 12))
    for corner, (x, y, z) in enumerate(slopes):
        b[:, 3 * corner : 3 * corner + 3] = [
            [x, 0, 0], [0, y, 0], [0, 0, z], [y, x, 0], [0, z, y], [z, 0, x],
        ]  # fmt: skip
    law = np.diag([2.0 * mu] * 3 + [mu] * 3)
    law[:3, :3] += lam
    return np.asarray(volume_m3 * b.T @ law @ b)


def test_linear_tetrahedra_are_those_worked_out_by_hand() -> None:
    pattern = pattern_of_kind("tetrahedra", 1)
    space, lame = pattern.space, pattern.foam.lame_pa
    found = element_stiffness_n_m(space, pattern.foam)
    exact = np.array([of_a_tetrahedron(space.node_m[cell], *lame) for cell in space.cells])
    np.testing.assert_allclose(found, exact, rtol=0.0, atol=ROUND_OFF * np.abs(exact).max())
    # rho V / 20 between two corners, and twice that of one with itself
    masses = element_mass_kg(space, pattern.foam)
    volume_m3 = space.weight.sum(axis=1)[:, None, None]
    by_hand = pattern.foam.density_kg_m3 * volume_m3 / 20.0 * (1.0 + np.eye(4))
    np.testing.assert_allclose(masses, by_hand, rtol=ROUND_OFF)


@pytest.mark.parametrize("kind", KINDS)
@pytest.mark.parametrize("order", [1, 2])
def test_blocks_are_scikit_fems_vector_form_and_the_tangent_at_rest(kind: str, order: int) -> None:
    pattern = pattern_of_kind(kind, order)
    space, foam = pattern.space, pattern.foam
    found = pattern.stiffness.toarray()
    element = ElementVector(_ELEMENTS[type(space.mesh)][order - 1]())
    basis: Any = Basis(space.mesh, element, intorder=space.slope_degree)
    vector = space.thickness_m * linear_elasticity(*foam.lame_pa).assemble(basis).toarray()
    near = ROUND_OFF * np.abs(vector).max()
    np.testing.assert_allclose(found, vector, rtol=0.0, atol=near)
    tangent = space.assembled(element_tangent_n_m(space, foam, np.zeros_like(space.node_m)))
    np.testing.assert_allclose(found, tangent.toarray(), rtol=0.0, atol=near)


@pytest.mark.parametrize("kind", KINDS)
def test_distorted_elements_weigh_what_their_volume_does(kind: str) -> None:
    straight = pattern_of_kind(kind, 2)
    mesh = distorted(mesh_of_kind(kind))
    pattern = type(straight)(mesh, straight.supports, thickness_m=straight.space.thickness_m
                             if mesh.dim() == 2 else None)  # fmt: skip
    whole_kg = element_mass_kg(pattern.space, pattern.foam).sum()
    exact_kg = pattern.foam.density_kg_m3 * straight.space.weight.sum()
    assert whole_kg == pytest.approx(exact_kg, rel=ROUND_OFF)
    assert pattern.mass_kg.sum() == pytest.approx(exact_kg, rel=ROUND_OFF)
