"""Points of a regular grid over a cavity, and how deep inside it they lie."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from sandmould.scenario.geometry import Array, Cavity


@dataclass(frozen=True)
class CavityGrid:
    """Centres of equal square or cubic cells over the box round a cavity."""

    spacing_m: float
    points_m: Array
    """(..., d) float64, m: one axis of the grid a dimension."""
    inside_m: Array
    """(...) float64, m: distance of each from the cavity's border, positive inside."""


def cavity_grid(
    cavity: Cavity, spacing_m: float, most_points: int, margin_m: float = 0.0
) -> CavityGrid:
    """Lay a grid over a cavity, as much beyond one side of it as beyond the other.

    Parameters
    ----------
    cavity : Cavity
    spacing_m : float, m
        Wider where there would be too many points.
    most_points : int
    margin_m : float, m, optional
        How far the grid goes beyond the box round the cavity.

    Returns
    -------
    CavityGrid
    """
    corners_m = cavity.space.corners()
    low_m, high_m = corners_m.min(axis=0) - margin_m, corners_m.max(axis=0) + margin_m
    size_m = high_m - low_m
    spacing_m = max(spacing_m, math.prod(size_m.tolist()) ** (1 / len(size_m))
                    / most_points ** (1 / len(size_m)))  # fmt: skip
    count = np.maximum(1, np.ceil(size_m / spacing_m * (1.0 - 1e-9))).astype(np.int64)
    first_m = 0.5 * (low_m + high_m) - 0.5 * (count - 1) * spacing_m
    axes_m = [start + spacing_m * np.arange(n) for start, n in zip(first_m, count, strict=True)]
    points_m = np.stack(np.meshgrid(*axes_m, indexing="ij"), axis=-1)
    inside_m = -cavity.space.distance_m(points_m.reshape(-1, len(size_m)))
    return CavityGrid(spacing_m, points_m, inside_m.reshape(points_m.shape[:-1]))
