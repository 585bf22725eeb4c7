"""Temperatures at points between elements."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np
from scipy.sparse import csr_array
from scipy.spatial import cKDTree

from sandmould.arrays import Floats
from sandmould.casting.arpm.elements import Elements

REACH = 1.6
"""Of the nearest element's size: at least the elements all round a point, corners included."""


def probe_weights(elements: Elements, probes_m: Mapping[str, Floats]) -> csr_array:
    """Weights of the elements round each point that give a linear temperature exactly.

    Moving least squares over elements of the material that the point is in (Lancaster and
    Salkauskas, Mathematics of Computation 37 (1981) 141-158).

    Gives (len(probes_m), n) sparse float64. ``probes_m``: mapping of name to (d,) float64, m.

    Raises
    ------
    ValueError
        When a point lies outside the box.
    """
    rows = np.zeros(0, dtype=np.int64)
    columns, values = rows, np.zeros(0)
    tree = cKDTree(elements.position_m)
    for number, (name, place) in enumerate(probes_m.items()):
        place = np.asarray(place, dtype=np.float64)
        if place.shape != elements.low_m.shape:
            raise ValueError(f"probe {name} is at {place.tolist()}; it needs "
                             f"{elements.dimensions} coordinates")  # fmt: skip
        if (place < elements.low_m).any() or (place > elements.high_m).any():
            raise ValueError(
                f"probe {name} is at {place.tolist()} m; it must lie in the box from "
                f"{elements.low_m.tolist()} to {elements.high_m.tolist()} m"
            )
        used, weight = _weights(elements, tree, place)
        rows = np.append(rows, np.full(len(used), number))
        columns, values = np.append(columns, used), np.append(values, weight)
    return csr_array((values, (rows, columns)), (len(probes_m), len(elements.size_m)))


def _weights(elements: Elements, tree: cKDTree, place: Floats) -> tuple[Floats, Floats]:
    owner = _owner(elements, tree, place)
    own_size = elements.size_m[owner]
    near = np.array(tree.query_ball_point(place, REACH * 1.5 * own_size))
    near = near[elements.material[near] == elements.material[owner]]
    away = (elements.position_m[near] - place) / own_size
    # falls to nothing at the reach and is largest at the point itself
    share = np.maximum(1.0 - np.linalg.norm(away, axis=1) / (1.5 * REACH), 0.0) ** 4
    basis = np.hstack([np.ones((len(near), 1)), away])
    root = np.sqrt(share)[:, None]
    # the least-norm solution: a plate one element thick has no slope across it
    return near, np.linalg.pinv(basis * root, rcond=1e-9)[0] * root[:, 0]


def _owner(elements: Elements, tree: cKDTree, place: Floats) -> int:
    """The element whose square or cube holds a point, or the nearest centre."""
    near = tree.query(place, k=min(16, len(elements.size_m)))[1].reshape(-1)
    beyond = np.abs(elements.position_m[near] - place).max(axis=1) / elements.size_m[near]
    return int(near[np.argmin(beyond)])
