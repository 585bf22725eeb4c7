"""Pairs of near grains, found by a k-d tree in bounded memory."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np
from numpy.typing import NDArray

from sandmould.arrays import Centres, Radii
from sandmould.geometry.geometry import Array

_CHUNK = 32_768
"""Grains whose pairs are held in memory together."""


def near_pairs(
    position_m: Array, reach_m: float
) -> Iterator[tuple[NDArray[np.int64], NDArray[np.int64], Array]]:
    """Give every pair of centres not farther apart than the reach, once, in a few portions.

    ``position_m``: (n, d) float64, m.

    Yields
    ------
    first, second : (p,) int64
        Indices of the grains of each pair.
    distance_m : (p,) float64, m
    """
    from scipy.spatial import cKDTree  # a third of a second

    n = len(position_m)
    if n < 2:
        return
    # grains in order along the longest side: a portion meets only those just ahead of it
    axis = int(np.argmax(np.ptp(position_m, axis=0)))
    order = np.argsort(position_m[:, axis])
    sorted_m = position_m[order]
    for start in range(0, n, _CHUNK):
        own = min(_CHUNK, n - start)
        limit = sorted_m[start + own - 1, axis] + reach_m
        stop = int(np.searchsorted(sorted_m[:, axis], limit, side="right"))
        local_m = sorted_m[start:stop]
        tree = cKDTree(local_m, balanced_tree=False, compact_nodes=False)
        pairs = tree.query_pairs(reach_m, output_type="ndarray")
        # pairs come as (lower, higher); those wholly ahead belong to a later portion
        pairs = pairs[pairs[:, 0] < own]
        first, second = pairs[:, 0], pairs[:, 1]
        apart_m = local_m[first] - local_m[second]
        distance_m = np.sqrt(np.einsum("ij,ij->i", apart_m, apart_m))
        yield order[start + first], order[start + second], distance_m


def touching_pairs(
    position_m: Centres, radius_m: Radii, gap_m: float = 0.0
) -> Iterator[tuple[NDArray[np.int64], NDArray[np.int64], Array]]:
    """Give every pair of grains whose surfaces are nearer than a gap, once, in a few portions.

    Yields
    ------
    first, second : (p,) int64
        Indices of the grains of each pair.
    overlap_m : (p,) float64, m
        r1 + r2 - distance; negative across a gap.
    """
    reach_m = 2 * float(radius_m.max(initial=0.0)) + gap_m
    for first, second, distance_m in near_pairs(position_m, reach_m):
        overlap_m = radius_m[first] + radius_m[second] - distance_m
        keep = overlap_m > -gap_m
        yield first[keep], second[keep], overlap_m[keep]
