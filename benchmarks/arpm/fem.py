"""Finite elements of scikit-fem for the plates, as a peer of elements and finite differences."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray
from scipy.sparse import block_diag
from skfem import Basis, ElementQuad1, MeshQuad
from skfem.models.poisson import laplace

from sandmould.casting.arpm.elements import Elements
from sandmould.casting.arpm.exchange import Exchange, from_rows
from sandmould.casting.arpm.filling import Filling
from sandmould.casting.arpm.raster import Raster

Array = NDArray[np.float64]


def fem_exchange(raster: Raster, filling: Filling) -> tuple[Elements, Exchange]:
    """Bilinear squares with lumped masses; two nodes wherever casting and mould meet.

    Parameters
    ----------
    raster : Raster
        Of 2D.
    filling : Filling
        With a resistance above 0.

    Returns
    -------
    elements : Elements
        The nodes; their sizes are the cells'.
    exchange : Exchange
    """
    cell = raster.cell_m
    parts = [_of_one_material(raster, number) for number in range(len(filling.materials))]
    stiffness = block_diag(
        [k * laplace.assemble(Basis(mesh, ElementQuad1()))
         for (mesh, _), k in zip(parts, filling.conductivity_w_m_k, strict=True)]
    ).tocoo()  # fmt: skip
    place = np.concatenate([mesh.p.T for mesh, _ in parts])
    material = np.repeat(np.arange(len(parts)), [mesh.p.shape[1] for mesh, _ in parts])
    volume = np.concatenate(
        [np.bincount(mesh.t.ravel(), minlength=mesh.p.shape[1]) for mesh, _ in parts]
    ) * (0.25 * cell**2)  # fmt: skip
    apart = stiffness.row != stiffness.col
    row, column, through = stiffness.row[apart], stiffness.col[apart], -stiffness.data[apart]
    node, partner = _across(raster, [grid for _, grid in parts], parts[0][0].p.shape[1])
    met = np.full(2 * len(node), 0.5 * cell / filling.resistance_m2k_w)
    row, column = np.concatenate([row, node, partner]), np.concatenate([column, partner, node])
    rate = np.concatenate([through, met]) / volume[row]
    high = raster.low_m + cell * np.array(raster.material.shape)
    nodes = Elements(place, np.full(len(place), cell), material, raster.low_m, high)
    return nodes, from_rows(row.astype(np.int64), column.astype(np.int64), rate, volume)


def _of_one_material(raster: Raster, number: int) -> tuple[MeshQuad, NDArray[np.int64]]:
    """Squares of one material, and the number of its node at each corner of the grid, or -1."""
    cells = np.argwhere(raster.material == number)
    corners = cells[:, None] + np.array([(0, 0), (1, 0), (1, 1), (0, 1)])
    shape = tuple(np.array(raster.material.shape) + 1)
    flat = np.ravel_multi_index((corners[..., 0], corners[..., 1]), shape)
    used, local = np.unique(flat, return_inverse=True)
    at = np.column_stack(np.unravel_index(used, shape)) * raster.cell_m + raster.low_m
    grid = np.full(shape, -1, dtype=np.int64)
    grid.reshape(-1)[used] = np.arange(len(used))
    return MeshQuad(at.T.copy(), local.reshape(-1, 4).T.copy()), grid


def _across(
    raster: Raster, grids: list[NDArray[np.int64]], first_count: int
) -> tuple[NDArray[np.int64], NDArray[np.int64]]:
    """Nodes that face each other, once for each half of a cell's side between materials."""
    pairs = []
    for axis in (0, 1):
        sides = np.argwhere(np.diff(raster.material, axis=axis) != 0)
        sides[:, axis] += 1
        step = np.eye(2, dtype=np.int64)[1 - axis]
        for corner in (sides, sides + step):
            x, y = corner.T
            pairs.append((grids[0][x, y], grids[1][x, y] + first_count))
    node, partner = (np.concatenate(side) for side in zip(*pairs, strict=True))
    return node, partner
