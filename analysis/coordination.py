"""Contacts of the grains with one another, the walls and the solids."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from sandmould.arrays import Centres, Radii
from sandmould.engines.neighbours import touching_pairs
from sandmould.geometry.geometry import Array, Scene, Solid, Wall, distance_within


@dataclass(frozen=True)
class ContactCounts:
    """Number of contacts of the grains, and how deep they are."""

    count: NDArray[np.int64]
    """(n,) int64: contacts of each grain with grains, walls and solids."""
    grain_grain: int
    """Pairs of grains in contact."""
    grain_wall: int
    """Contacts of grains with walls and solids."""
    mean_coordination: float
    """Mean of ``count`` over all grains; NaN without grains."""
    mean_coordination_bearing: float
    """Mean of ``count`` over the bearing grains; NaN when there is none."""
    bearing_fraction: float
    """Share of the grains that bear: two or more contacts in 2D, three or more in 3D."""
    largest_overlap_fraction: float
    """Deepest overlap over the smaller radius, walls and solids included; 0 without overlap."""
    overlap_p99_fraction: float
    """What 99 of 100 overlaps over the smaller radius do not exceed; 0 without overlap."""


def contacts(
    position_m: Centres, radius_m: Radii, scene: Scene | None = None, tolerance_m: float = 0.0
) -> ContactCounts:
    """Count the contacts: overlaps deeper than minus the tolerance.

    A grain with fewer than two contacts in 2D, or three in 3D, cannot be held by friction: it is a
    rattler and left out of ``mean_coordination_bearing``. The test is made once, so a grain held
    only by rattlers still counts as bearing. A solid counts once, also for a grain in its notch.

    ``scene``: walls and solids; without it only contacts between grains are counted.
    ``tolerance_m``: largest gap that still counts as contact.
    """
    n, dimension = position_m.shape
    count = np.zeros(n, dtype=np.int64)
    grain_grain = grain_wall = 0
    depths: list[Array] = []
    for first, second, overlap_m in touching_pairs(position_m, radius_m, max(tolerance_m, 0.0)):
        touch = overlap_m > -tolerance_m
        count += np.bincount(first[touch], minlength=n) + np.bincount(second[touch], minlength=n)
        grain_grain += int(touch.sum())
        smaller_m = np.minimum(radius_m[first], radius_m[second])
        depths.append(overlap_m / smaller_m)
    reach_m = float(radius_m.max(initial=0.0)) + max(tolerance_m, 0.0)
    surfaces: tuple[Wall | Solid, ...] = ()
    if scene is not None:
        surfaces = (*scene.walls, *scene.solids)
    for surface in surfaces:
        overlap_m = radius_m - distance_within(surface, position_m, reach_m)
        touch = overlap_m > -tolerance_m
        count += touch
        grain_wall += int(touch.sum())
        depths.append(overlap_m / radius_m)
    depth = np.concatenate(depths) if depths else np.empty(0)
    depth = depth[depth > 0.0]
    bearing = count >= dimension
    return ContactCounts(
        count=count,
        grain_grain=grain_grain,
        grain_wall=grain_wall,
        mean_coordination=_mean(count),
        mean_coordination_bearing=_mean(count[bearing]),
        bearing_fraction=_mean(bearing),
        largest_overlap_fraction=float(depth.max(initial=0.0)),
        overlap_p99_fraction=float(np.quantile(depth, 0.99)) if len(depth) else 0.0,
    )


def _mean(values: NDArray[np.int64] | NDArray[np.bool_]) -> float:
    """Mean, NaN of nothing."""
    return float(values.mean()) if len(values) else float("nan")
