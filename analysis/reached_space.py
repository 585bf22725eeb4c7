"""How much of a cavity sand can come to at all."""

from __future__ import annotations

from weakref import WeakKeyDictionary

import numpy as np
from scipy.ndimage import label
from scipy.spatial import cKDTree

from sandmould.geometry.geometry import Cavity, Scene
from sandmould.scenario.cavities import CELLS_A_GRAIN, cavity_grid, drawn_inside

_MOST_PLACES = 200_000
"""Of the grid on which the middle of a grain is led in."""
_DRAWN = 50_000
"""Places in the box round the cavity: a share of 0.95 comes out to 0.001."""
_RADII = 4
"""Of balls that cover what a grain reaches: from its own down to what the grid tells of it."""
_KNOWN: WeakKeyDictionary[Cavity, dict[float, float]] = WeakKeyDictionary()
"""What was found of each cavity, which belongs to one scene, by the grain: asked at every moment.
"""


def reached_share(cavity: Cavity, scene: Scene, grain_m: float) -> float:
    """Share of a cavity that grains of one size can cover, coming in through its mouth.

    It lacks sharp edges, gaps narrower than the grain, and what lies behind them. A gap that is
    narrower by less than a cell's diagonal, 9 % of the grain in 2D and 22 % in 3D, may pass.
    """
    known = _KNOWN.setdefault(cavity, {})
    if grain_m not in known:
        known[grain_m] = _reached_share(cavity, scene, grain_m)
    return known[grain_m]


def _reached_share(cavity: Cavity, scene: Scene, grain_m: float) -> float:
    dimension = scene.dimension
    grid = cavity_grid(cavity, grain_m / CELLS_A_GRAIN[dimension], _MOST_PLACES, margin_m=grain_m)
    places_m = grid.points_m.reshape(-1, dimension)
    clear_m = scene.clearance_m(places_m, grain_m)
    slack_m = 0.5 * float(np.linalg.norm(grid.spacing_m))
    free = (clear_m >= 0.5 * grain_m - slack_m).reshape(grid.inside_m.shape)
    way = label(free, structure=np.ones((3,) * dimension))[0].ravel()
    before = cavity.depth_m(places_m) < 0.0
    come_in = np.isin(way, np.setdiff1d(way[before], 0))
    drawn_m = drawn_inside(cavity, _DRAWN)
    covered = np.zeros(len(drawn_m), dtype=np.bool_)
    # A place of the grid a little too near to a surface stands for one beside it that touches it.
    for lack_m in slack_m * np.linspace(0.0, 1.0, _RADII):
        middle_m = places_m[come_in & (clear_m >= 0.5 * grain_m - lack_m)]
        reach_m = 0.5 * grain_m - lack_m + slack_m / (_RADII - 1)
        left = np.flatnonzero(~covered)
        nearest_m, _ = cKDTree(middle_m).query(drawn_m[left], distance_upper_bound=reach_m)
        covered[left] = np.isfinite(nearest_m)
    return float((covered & (scene.clearance_m(drawn_m, 0.0) > 0.0)).sum()) / len(drawn_m)
