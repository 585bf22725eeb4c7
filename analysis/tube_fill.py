"""How far and how densely the sand has filled the bore of a tube, and where layers have gone."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from sandmould.analysis.intersections import depth_in_polygon_m, disc_polygon_m2, sphere_prism_m3
from sandmould.arrays import Centres, Radii
from sandmould.geometry.geometry import Array, Bore


@dataclass(frozen=True)
class TubeFill:
    """Sand in the bore of one tube."""

    sand_measure: float
    """m2 in 2D, m3 in 3D: exact parts of the grains inside the bore."""
    fill_fraction: float
    """Sand over the measure of the bore; a dense bed gives its solid fraction, not 1."""
    grains_inside: int
    """Grains whose centre lies inside the bore."""
    front_depth_m: float
    """Depth behind the mouth that the deepest grain edge has reached; 0 when empty."""


def tube_fill(position_m: Centres, radius_m: Radii, bore: Bore) -> TubeFill:
    """Measure the sand in a bore, cut grains counted by their exact parts.

    The walls of the tube are not part of the bore, so a grain that rests on the outside of a wall
    never counts. Overlaps of two grains count twice.
    """
    part = sand_in_bore(position_m, radius_m, bore)
    depth_m, across_m = bore.local(position_m)
    # a grain across the rim reaches less deep than its radius: only those before the mouth's
    # opening or behind it make the front
    in_line = _across_inside_m(across_m, bore) > 0.0
    edge_m = np.minimum(depth_m + radius_m, bore.length_m)[in_line & (part > 0.0)]
    sand = float(part.sum())
    return TubeFill(
        sand_measure=sand,
        fill_fraction=sand / bore.measure,
        grains_inside=int(lies_in_bore(position_m, bore).sum()),
        front_depth_m=float(edge_m.max(initial=0.0)),
    )


def sand_in_bore(position_m: Centres, radius_m: Radii, bore: Bore) -> Array:
    """Part of each grain inside the bore, (n,) float64, m2 in 2D or m3 in 3D.

    In 3D grains cut by an edge of the bore carry an error below 1e-6 of their part.
    """
    depth_m, across_m = bore.local(position_m)
    local_m, to_m = np.column_stack([across_m, depth_m]), bore.length_m
    if across_m.shape[1] == 2:
        return sphere_prism_m3(local_m, radius_m, bore.section_m, 0.0, to_m)
    left, right = bore.section_m[:, 0]
    rectangle_m = np.array([[left, 0.0], [right, 0.0], [right, to_m], [left, to_m]])
    return disc_polygon_m2(local_m, radius_m, rectangle_m)


def lies_in_bore(position_m: Array, bore: Bore) -> NDArray[np.bool_]:
    """Tell which points lie in a bore, (n,) bool."""
    depth_m, across_m = bore.local(position_m)
    inside = _across_inside_m(across_m, bore) > 0.0
    return inside & (depth_m > 0.0) & (depth_m < bore.length_m)


def _across_inside_m(across_m: Array, bore: Bore) -> Array:
    """Distance across the axis from the bore's wall, positive inside, (n,) float64, m."""
    if across_m.shape[1] == 2:
        return depth_in_polygon_m(across_m, bore.section_m)
    left, right = bore.section_m[:, 0]
    return np.minimum(across_m[:, 0] - left, right - across_m[:, 0])


def tube_shares(
    position_m: Centres, radius_m: Radii, layer: NDArray[np.int64], bore: Bore
) -> dict[int, float]:
    """Share of the sand in a tube that each layer of fill has brought, by its number.

    They add to 1; there are none where there is no sand. ``layer``: (n,) int64.
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
