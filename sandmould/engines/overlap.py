"""Which grains touch, and by how much they overlap."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.spatial import cKDTree

from sandmould.scenario.geometry import Array


@dataclass(frozen=True)
class Pairs:
    """Pairs of grains nearer than a gap."""

    first: NDArray[np.int64]
    second: NDArray[np.int64]
    overlap_m: Array
    """(k,) float64, m: r1 + r2 - distance; negative across a gap."""


def near_pairs(position_m: Array, radius_m: Array, gap_m: float = 0.0) -> Pairs:
    """Find all pairs of grains whose surfaces are nearer than a gap.

    Parameters
    ----------
    position_m : (n, d) float64, m
    radius_m : (n,) float64, m
    gap_m : float
        0 keeps touching pairs only.

    Returns
    -------
    Pairs
    """
    if len(radius_m) < 2:
        none = np.empty(0, dtype=np.int64)
        return Pairs(none, none, np.empty(0))
    tree = cKDTree(position_m)
    found = tree.query_pairs(2 * radius_m.max() + gap_m, output_type="ndarray")
    i, j = found[:, 0], found[:, 1]
    distance = np.linalg.norm(position_m[i] - position_m[j], axis=1)
    overlap = radius_m[i] + radius_m[j] - distance
    keep = overlap > -gap_m
    return Pairs(i[keep], j[keep], overlap[keep])
