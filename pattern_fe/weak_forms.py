"""Elasticity and inertia as weak forms of scikit-fem, one small matrix an element.

Find u with  int lambda div u div v + 2 mu e(u) : e(v) dx = int f . v dx  for all v, e the
symmetric gradient (Hughes, The Finite Element Method, section 2.7). The vector form is put together
from scalar ones, G_ij = int d_i v d_j u dx, one a pair of axes: between the components i of v and j
of u stands  lambda G_ij + mu G_ji + delta_ij mu sum_k G_kk. In hexahedra of second order that takes
a fifteenth of the time of the vector form, which asks for every pair of components.
"""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray
from skfem import BilinearForm
from skfem.models.poisson import mass

from sandmould.pattern_fe.material import Foam
from sandmould.pattern_fe.space import Space

Array = NDArray[np.float64]


def _product_of_slopes(i: int, j: int) -> BilinearForm:
    """Weak form  int d_i v d_j u dx."""
    return BilinearForm(lambda u, v, w: v.grad[i] * u.grad[j])


def element_stiffness_n_m(space: Space, foam: Foam) -> Array:
    """Forces that hold the nodes of each element over their small displacements.

    Gives (ne, k d, k d) float64, N/m; components node by node, x before y before z.
    """
    lam, mu = foam.lame_pa
    d, basis = space.dimension, space.basis(space.slope_degree)
    slopes = [[_local(_product_of_slopes(i, j), basis) for j in range(d)] for i in range(d)]
    ne, k, _ = slopes[0][0].shape
    shear = mu * sum(slopes[i][i] for i in range(d))
    whole = np.empty((ne, k, d, k, d))
    for i in range(d):
        for j in range(d):
            whole[:, :, i, :, j] = lam * slopes[i][j] + mu * slopes[j][i]
        whole[:, :, i, :, i] += shear
    return space.thickness_m * whole.reshape(ne, k * d, k * d)


def element_mass_kg(space: Space, foam: Foam) -> Array:
    """Consistent mass of each element, of one component, (ne, k, k) float64, kg."""
    weight = foam.density_kg_m3 * space.thickness_m
    return weight * _local(mass, space.basis(2 * space.order))


def _local(form: Any, basis: Any) -> Array:
    """Matrices of the elements: row of the test function, column of the other."""
    return np.swapaxes(form.coo_data(basis).tolocal(), 1, 2)
