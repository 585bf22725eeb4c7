"""Points of a regular grid over a cavity, and how deep inside it they lie."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from sandmould.geometry.geometry import Array, Cavity

CELLS_A_GRAIN = {2: 16, 3: 8}
"""Cells along a grain's diameter, by dimension."""


@dataclass(frozen=True)
class CavityGrid:
    """Centres of equal cells that fill the box round a cavity."""

    spacing_m: Array
    """(d,) float64, m: edges of a cell, nearly equal."""
    points_m: Array
    """(..., d) float64, m: one axis of the grid a dimension."""
    inside_m: Array
    """(...) float64, m: distance of each from the cavity's border, positive inside."""


def cavity_grid(
    cavity: Cavity, spacing_m: float, most_points: int, margin_m: float = 0.0
) -> CavityGrid:
    """Lay a grid over a cavity.

    Parameters
    ----------
    cavity : Cavity
    spacing_m : float, m
        Longest edge of a cell; longer where there would be too many.
    most_points : int
    margin_m : float, m, optional
        How far the grid goes beyond the box round the cavity.
    """
    corners_m = cavity.space.corners()
    low_m = corners_m.min(axis=0) - margin_m
    size_m = corners_m.max(axis=0) + margin_m - low_m
    widest_m = max(spacing_m, float(np.prod(size_m) / most_points) ** (1 / len(size_m)))
    count = np.maximum(1, np.ceil(size_m / widest_m * (1.0 - 1e-9))).astype(np.int64)
    cell_m = size_m / count
    axes_m = [
        low + cell * (np.arange(n) + 0.5) for low, cell, n in zip(low_m, cell_m, count, strict=True)
    ]
    points_m = np.stack(np.meshgrid(*axes_m, indexing="ij"), axis=-1)
    inside_m = -cavity.space.distance_m(points_m.reshape(-1, len(size_m)))
    return CavityGrid(cell_m, points_m, inside_m.reshape(points_m.shape[:-1]))
