"""Where the sand of each layer of fill has gone, and how far the layers have mixed."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from sandmould.analysis.tube_fill import sand_in_bore
from sandmould.arrays import Centres, Radii
from sandmould.geometry.geometry import Bore


def tube_shares(
    position_m: Centres, radius_m: Radii, layer: NDArray[np.int64], bore: Bore
) -> dict[int, float]:
    """Share of the sand in a tube that each layer of fill has brought, by its number.

    They add to 1; there are none where there is no sand.

    ``layer``: (n,) int64.
    """
    number, row = np.unique(layer, return_inverse=True)
    sand = np.bincount(row, weights=sand_in_bore(position_m, radius_m, bore))
    whole = float(sand.sum())
    return dict(zip(number.tolist(), (sand / whole).tolist(), strict=True)) if whole else {}


def mixing_index(position_m: Centres, layer: NDArray[np.int64]) -> float:
    """Mixing of the layers: 0 apart, 1 as if the grains had been dealt out at random.

    Let u be the share of unlike grains (of another layer) among the nearest neighbours of a grain,
    six in 2D and twelve in 3D, averaged over all grains. Dealt out at random, u would on average be
    ``u_r = sum_k p_k (n - n_k)/(n - 1)`` with the layers' counts ``n_k = p_k n``. The index is
    ``u/u_r``: layers just filled score the small share of neighbours across their interfaces, and
    an ordered arrangement can pass 1. With but one layer there is nothing to mix: 0.

    ``layer``: (n,) int64.
    """
    n, dimension = position_m.shape
    count = np.unique(layer, return_counts=True)[1].astype(np.float64)
    if len(count) < 2:
        return 0.0
    random = float(np.sum(count / n * (n - count)) / (n - 1))
    from scipy.spatial import cKDTree

    neighbours = min(6 if dimension == 2 else 12, n - 1)
    nearest = cKDTree(position_m).query(position_m, k=neighbours + 1)[1]
    other = layer[nearest] != layer[:, None]
    # the grain itself is among the nearest and never unlike
    return float(other.sum() / (n * neighbours)) / random
