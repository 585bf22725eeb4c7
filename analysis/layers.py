"""Where the sand of each layer of fill has gone, and how far the layers have mixed."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from sandmould.analysis.tube_fill import sand_in_bore
from sandmould.geometry.geometry import Array, Bore


@dataclass(frozen=True)
class LayerTable:
    """One row a layer, in order of filling."""

    layer: NDArray[np.int64]
    """(k,) int64: number of the layer."""
    count: NDArray[np.int64]
    """(k,) int64: its grains."""
    mean_height_m: Array
    """(k,) float64, m: height of its centre of mass."""
    tube_share: Array
    """(k,) float64: its share of the sand in the tube; they add to 1, NaN if there is no sand."""


def layer_table(
    position_m: Array, radius_m: Array, layer: NDArray[np.int64], bore: Bore | None = None
) -> LayerTable:
    """Count and place the sand of each layer.

    Parameters
    ----------
    position_m : (n, d) float64, m
    radius_m : (n,) float64, m
    layer : (n,) int64
    bore : Bore, optional
        The tube whose sand is shared out; without it ``tube_share`` is NaN.
    """
    number, row, count = np.unique(layer, return_inverse=True, return_counts=True)
    weight = radius_m ** position_m.shape[1]
    moment = np.bincount(row, weights=weight * position_m[:, -1])
    share = np.full(len(number), np.nan)
    if bore is not None:
        sand = np.bincount(row, weights=sand_in_bore(position_m, radius_m, bore))
        if sand.sum() > 0.0:
            share = sand / sand.sum()
    return LayerTable(
        layer=number,
        count=count.astype(np.int64),
        mean_height_m=moment / np.bincount(row, weights=weight),
        tube_share=share,
    )


def mixing_index(
    position_m: Array,
    layer: NDArray[np.int64],
    as_filled_position_m: Array | None = None,
) -> float:
    """Mixing of the layers: 0 as filled, 1 as if the grains had been dealt out at random.

    Let u be the share of unlike grains (of another layer) among the nearest neighbours of a grain,
    six in 2D and twelve in 3D, averaged over all grains. Dealt out at random, u would on average be
    ``u_r = sum_k p_k (n - n_k)/(n - 1)`` with the layers' counts ``n_k = p_k n``. The index is
    ``(u - u_0)/(u_r - u_0)``, with u_0 from the same grains where they lay after filling. It can
    pass 1 for an ordered arrangement and fall below 0 when layers draw apart.

    Parameters
    ----------
    position_m : (n, d) float64, m
    layer : (n,) int64
    as_filled_position_m : (n, d) float64, m, optional
        The same grains in the same order before vibration. Without it u_0 = 0, and layers just
        filled score the small share of neighbours across their interfaces.

    Returns
    -------
    float
        0 when there is but one layer: there is nothing to mix. NaN when u_0 equals u_r.

    Raises
    ------
    ValueError
        When the two sets of positions differ in shape.
    """
    n = len(position_m)
    count = np.unique(layer, return_counts=True)[1].astype(np.float64)
    if len(count) < 2:
        return 0.0
    random = float(np.sum(count / n * (n - count)) / (n - 1))
    filled = 0.0
    if as_filled_position_m is not None:
        if as_filled_position_m.shape != position_m.shape:
            raise ValueError("as_filled_position_m must hold the same grains as position_m")
        filled = _unlike_share(as_filled_position_m, layer)
    if random == filled:
        return float("nan")
    return (_unlike_share(position_m, layer) - filled) / (random - filled)


def _unlike_share(position_m: Array, layer: NDArray[np.int64]) -> float:
    """Mean share of grains of another layer among the nearest neighbours."""
    from scipy.spatial import cKDTree

    n, dimension = position_m.shape
    neighbours = min(6 if dimension == 2 else 12, n - 1)
    nearest = cKDTree(position_m).query(position_m, k=neighbours + 1)[1]
    other = layer[nearest] != layer[:, None]
    # the grain itself is among the nearest and never unlike
    return float(other.sum() / (n * neighbours))
