"""Nodes, shape functions and integration points of a pattern, as plain arrays."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy.sparse import coo_array, csc_array
from scipy.sparse.csgraph import connected_components
from scipy.sparse.linalg import SuperLU, splu
from skfem import (
    Basis,
    ElementHex1,
    ElementHex2,
    ElementQuad1,
    ElementQuad2,
    ElementTetP1,
    ElementTetP2,
    ElementTriP1,
    ElementTriP2,
    MeshHex1,
    MeshQuad1,
    MeshTet1,
    MeshTri1,
)

Array = NDArray[np.float64]
Indices = NDArray[np.int64]
_ELEMENTS = {
    MeshQuad1: (ElementQuad1, ElementQuad2),
    MeshTri1: (ElementTriP1, ElementTriP2),
    MeshHex1: (ElementHex1, ElementHex2),
    MeshTet1: (ElementTetP1, ElementTetP2),
}


@dataclass(frozen=True)
class Space:
    """Displacements that a mesh can have: one vector at each node, ``(n, d)`` row by row.

    Edges are straight; second order adds nodes inside edges, faces and elements.
    """

    mesh: Any
    order: int
    thickness_m: float
    """Out of the plane in 2D; 1 in 3D, where it multiplies nothing."""
    node_m: Array
    """(n, d) float64, m: places of the nodes on the drawing."""
    cells: Indices
    """(ne, k) int64: nodes of each element."""
    gradient: Array
    """(ne, q, k, d) float64, 1/m: of each shape function at each integration point."""
    weight: Array
    """(ne, q) float64, m3: volume that each integration point stands for."""

    @property
    def dimension(self) -> int:
        """2 or 3."""
        return self.node_m.shape[1]

    @property
    def slope_degree(self) -> int:
        """Degree of products of gradients of shape functions, which are integrated exactly."""
        return _slope_degree(self.mesh, self.order)

    @property
    def node_mesh(self) -> Any:
        """Mesh whose corners are the nodes in their order, in second order one twice as fine."""
        bare = type(self.mesh)(self.mesh.p, self.mesh.t)
        return bare if self.order == 1 else bare.refined()

    @cached_property
    def body_of_node(self) -> Indices:
        """Which of its bodies each node is of, (n,) int64: bodies share no node."""
        first, others = np.broadcast_arrays(self.cells[:, :1], self.cells[:, 1:])
        links = (np.ones(others.size), (first.ravel(), others.ravel()))
        found = connected_components(coo_array(links, shape=(len(self.node_m),) * 2), False)
        return np.asarray(found[1], dtype=np.int64)

    def basis(self, integrated_degree: int) -> Any:
        """Scalar basis of scikit-fem whose degrees of freedom are the nodes."""
        element = _ELEMENTS[type(self.mesh)][self.order - 1]()
        return Basis(self.mesh, element, intorder=integrated_degree)

    def nodes_of(self, boundary: str) -> Indices:
        """Nodes on a named boundary, ascending, (k,) int64."""
        facets = self.mesh.boundaries[boundary]
        nodes = self.basis(1).get_dofs(facets=facets).flatten()
        return np.asarray(nodes, dtype=np.int64)

    def assembled(self, matrices: Array) -> csc_array:
        """Sum matrices of elements into one of all nodes, (n d, n d) sparse float64.

        ``matrices``: (ne, k d, k d) float64.
        """
        d, n = self.dimension, self.node_m.size
        rows = (self.cells[:, :, None] * d + np.arange(d)).reshape(len(self.cells), -1)
        i, j = np.broadcast_arrays(rows[:, :, None], rows[:, None, :])
        return coo_array((matrices.ravel(), (i.ravel(), j.ravel())), shape=(n, n)).tocsc()

    def summed(self, values: Array) -> Array:
        """Sum vectors at the nodes of elements, (ne, k, d), into one at each node, (n, d)."""
        flat, n = self.cells.ravel(), len(self.node_m)
        columns = values.reshape(len(flat), -1).T
        return np.stack([np.bincount(flat, weights=c, minlength=n) for c in columns], axis=1)


def space_of(mesh: Any, order: int = 2, thickness_m: float | None = None) -> Space:
    """Set up shape functions on a mesh.

    ``mesh``: quadrilaterals, triangles, hexahedra or tetrahedra with straight edges.
    ``thickness_m``: out of the plane: in 2D it must be given, in 3D it must not.

    Raises
    ------
    ValueError
        When the element, its order or the thickness is not one of these.
    """
    if type(mesh) not in _ELEMENTS:
        valid = "quadrilaterals, triangles, hexahedra or tetrahedra with straight edges"
        raise ValueError(f"mesh of the pattern is a {type(mesh).__name__}, valid are {valid}")
    if order not in (1, 2):
        raise ValueError(f"order of the pattern's elements is {order}, valid is 1 or 2")
    if mesh.dim() == 3:
        if thickness_m is not None:
            raise ValueError(f"thickness of the pattern is {thickness_m} m, valid in 2D alone")
        thickness_m = 1.0
    elif thickness_m is None or not 0.0 < thickness_m < np.inf:
        raise ValueError(f"thickness of the pattern is {thickness_m} m, valid in 2D is above 0")
    degree = _slope_degree(mesh, order)
    basis = Basis(mesh, _ELEMENTS[type(mesh)][order - 1](), intorder=degree)
    gradients = [np.broadcast_to(b[0].grad, (mesh.dim(), *basis.dx.shape)) for b in basis.basis]
    return Space(
        mesh,
        order,
        thickness_m,
        np.ascontiguousarray(basis.doflocs.T),
        np.ascontiguousarray(basis.element_dofs.T, dtype=np.int64),
        np.ascontiguousarray(np.stack(gradients).transpose(2, 3, 0, 1)),
        np.ascontiguousarray(basis.dx * thickness_m),
    )


def _slope_degree(mesh: Any, order: int) -> int:
    """Of products of gradients: 2 (order - 1) in simplices, 2 order in an axis of the others."""
    degree = 2 * order if type(mesh) in (MeshQuad1, MeshHex1) else 2 * order - 2
    return max(1, degree)


def factorised(matrix: csc_array) -> SuperLU:
    """Factorise once, solve many times.

    Raises
    ------
    RuntimeError
        When the matrix is singular.
    """
    # ordering and pivots for symmetric matrices: a third of the fill of the default
    options = {"SymmetricMode": True}
    return splu(matrix, permc_spec="MMD_AT_PLUS_A", diag_pivot_thresh=0.0, options=options)
