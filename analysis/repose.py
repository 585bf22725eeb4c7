"""Angle of repose of a heap and of what stays in a hopper, from the free surface."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from sandmould.arrays import Centres, Radii
from sandmould.engines.neighbours import touching_pairs

Array = NDArray[np.float64]

HEAP_FOOT, FOOT, CREST = 0.35, 0.2, 0.8
"""Shares of a slope's height between which it is fitted: grains that rolled away lie below, the
crest that falling grains hit is round above. Sand that falls on a heap splashes: at its foot an
apron lies flatter than its slope, up to a third of its height."""
FEWEST_POINTS = 5
GAP = 0.05
"""Of the mean radius: grains no farther apart lie on each other. Rolling ones bounce a little."""
SECTORS = 4
"""Flanks of a cone, each an equal part of the circle."""


@dataclass(frozen=True)
class Flank:
    """A straight line through one side of a slope."""

    name: str
    angle_deg: float
    """Against the horizontal; NaN where the slope is too small to be fitted."""
    se_deg: float
    """Standard error of the fit, with the correlation of neighbouring points in it."""
    distance_m: tuple[float, float]
    """From the axis, where the fitted part begins and ends, upwards."""
    height_m: tuple[float, float]
    """Of the line at these places."""


@dataclass(frozen=True)
class Slope:
    """All flanks of a heap, or of what stays in a hopper."""

    axis_m: Array
    """(d - 1,) float64, m: distances count from it."""
    flanks: tuple[Flank, ...]

    @property
    def angle_deg(self) -> float:
        """Mean of the flanks; NaN where one could not be fitted."""
        return float(np.mean([flank.angle_deg for flank in self.flanks]))

    @property
    def se_deg(self) -> float:
        """Standard error of the mean: of the fits or of the flanks' scatter, the larger."""
        n = len(self.flanks)
        fits = math.sqrt(sum(flank.se_deg**2 for flank in self.flanks)) / n
        scatter = float(np.std([flank.angle_deg for flank in self.flanks], ddof=1)) if n > 1 else 0
        return max(fits, scatter / math.sqrt(n))


@dataclass(frozen=True)
class Surface:
    """Top of the sand over a grid of points."""

    point_m: Array
    """(m, d - 1) float64, m."""
    height_m: Array
    """(m,) float64, m; 0 where there is no sand."""


def lying(position_m: Centres, radius_m: Radii, floor_m: float) -> NDArray[np.bool_]:
    """Find grains that hang together with the floor: those that still fall do not, (n,) bool."""
    from scipy.sparse import coo_array
    from scipy.sparse.csgraph import connected_components

    n = len(radius_m)
    if not n:
        return np.zeros(0, dtype=np.bool_)
    gap_m = GAP * float(radius_m.mean())
    floor = np.flatnonzero(position_m[:, -1] - radius_m < floor_m + gap_m)
    pairs = [(first, second) for first, second, _ in touching_pairs(position_m, radius_m, gap_m)]
    first, second = np.hstack([*pairs, (floor, np.full(len(floor), n))])  # the floor is number n
    joined = coo_array((np.ones(len(first)), (first, second)), shape=(n + 1, n + 1))
    part = connected_components(joined, directed=False)[1]
    held: NDArray[np.bool_] = part[:n] == part[n]
    return held


def free_surface(
    position_m: Centres, radius_m: Radii, low_m: Array, high_m: Array, floor_m: float
) -> Surface:
    """Find the upper envelope of grains over a part of the floor.

    On cells about a mean diameter wide, each as high as the highest place in it: between grains one
    would see deep into the sand. ``low_m``, ``high_m``, (d - 1,) float64, m: bounds of the part.
    ``floor_m``: heights count from it; grains below it are left out.
    """
    if not len(radius_m):
        return Surface(0.5 * (low_m + high_m)[None], np.zeros(1))
    above = position_m[:, -1] > floor_m
    place, top, radius = position_m[above, :-1], position_m[above, -1] - floor_m, radius_m[above]
    step_m = 2 * float(radius_m.mean())
    cells = np.maximum(1, np.ceil((high_m - low_m) / step_m).astype(np.int64))
    width = (high_m - low_m) / cells
    axes = [low + (np.arange(n) + 0.5) * w for low, n, w in zip(low_m, cells, width, strict=True)]
    point = np.stack(np.meshgrid(*axes, indexing="ij"), axis=-1).reshape(-1, len(cells))
    height = np.zeros(len(point))
    own = np.floor((place - low_m) / width).astype(np.int64)
    reach = math.ceil(float(radius.max(initial=0.0)) / step_m) + 1
    for offset in np.ndindex(*[2 * reach + 1] * len(cells)):
        cell = own + np.array(offset) - reach
        inside = ((cell >= 0) & (cell < cells)).all(axis=1)
        flat = np.ravel_multi_index(tuple(cell[inside].T), tuple(cells))
        beyond = np.maximum(np.abs(point[flat] - place[inside]) - width / 2, 0.0)
        sag2 = radius[inside] ** 2 - (beyond**2).sum(axis=1)
        over = sag2 > 0.0
        np.maximum.at(height, flat[over], top[inside][over] + np.sqrt(sag2[over]))
    return Surface(point, height)


def profiles(surface: Surface, width_m: float, axis_m: Array) -> dict[str, tuple[Array, Array]]:
    """Profiles outwards from an axis: left and right in 2D, one a sector in 3D.

    Gives (distance_m, height_m) by name, each (k,) float64, m, in order of the distance.
    ``width_m``: of the columns or rings that the surface is averaged over: about one of the largest
    grains. ``axis_m``: (d - 1,) float64, m.
    """
    apart = surface.point_m - axis_m
    distance = np.sqrt((apart**2).sum(axis=1))
    if apart.shape[1] == 1:
        names, part = ["left", "right"], (apart[:, 0] > 0.0).astype(np.int64)
    else:
        names = [f"{360 * k // SECTORS} deg" for k in range(SECTORS)]
        turn = np.arctan2(apart[:, 1], apart[:, 0]) / (2 * math.pi) % 1.0
        part = np.minimum((turn * SECTORS).astype(np.int64), SECTORS - 1)
    # A ring holds many points: a single grain on the cone is not to raise it.
    middle = np.mean if apart.shape[1] == 1 else np.median
    of_part = {}
    for number, name in enumerate(names):
        r, z = distance[part == number], surface.height_m[part == number]
        column = np.floor(r / width_m).astype(np.int64)
        held = np.unique(column)
        of_part[name] = (
            np.array([r[column == k].mean() for k in held]),
            np.array([middle(z[column == k]) for k in held]),
        )
    return of_part


def fit_flank(name: str, distance_m: Array, height_m: Array, foot: float = FOOT) -> Flank:
    """Fit a line to a slope that rises along the given points.

    The slope is the median of those of all pairs of points (Theil 1950, Sen 1968), so that a few
    grains on the surface do not turn it. ``distance_m``, ``height_m``, (k,) float64, m: profile
    from foot to crest; only heights between ``foot`` and ``CREST`` of its largest, from the last
    point below that range on, are fitted.
    """
    crest_m = float(height_m.max(initial=0.0))
    top = int(np.argmax(height_m >= CREST * crest_m)) if len(height_m) else 0
    below = np.flatnonzero(height_m[:top] < foot * crest_m)
    fitted = slice(int(below[-1]) + 1 if len(below) else 0, top)
    x, z = distance_m[fitted], height_m[fitted]
    if len(x) < FEWEST_POINTS:
        nowhere = (math.nan, math.nan)
        return Flank(name, math.nan, math.nan, nowhere, nowhere)
    # scipy.stats takes most of a second to import, and most runs have no heap.
    from scipy.stats import theilslopes

    slope, intercept = theilslopes(z, x)[:2]
    angle = math.atan(abs(slope))
    se = math.degrees(_slope_error(x, z - intercept - slope * x) * math.cos(angle) ** 2)
    ends = (float(x[0]), float(x[-1]))
    heights = (float(intercept + slope * x[0]), float(intercept + slope * x[-1]))
    return Flank(name, math.degrees(angle), se, ends, heights)


def _slope_error(x: Array, residual: Array) -> float:
    """Standard error of a slope; residuals of correlation c leave n (1 - c)/(1 + c) free points."""
    n = len(x)
    residual = residual - residual.mean()
    variance = float((residual**2).sum())
    if variance == 0.0:
        return 0.0
    c = max(0.0, float((residual[1:] * residual[:-1]).sum()) / variance)
    inflation = (1 + c) / max(1 - c, 1 / n)
    return math.sqrt(variance / (n - 2) / float(((x - x.mean()) ** 2).sum()) * inflation)


def heap_slope(surface: Surface, width_m: float, axis_m: Array) -> Slope:
    """Slope of a heap under an outlet.

    ``axis_m``, (d - 1,) float64, m: where the sand fell; in 2D the crest beside it is looked for.
    """
    if len(axis_m) == 1:
        crest, height_m = surface.height_m.argmax(), surface.height_m.max(initial=0.0)
        # The crest of a cone is not looked for: a few grains high up would turn all sectors.
        axis_m = surface.point_m[crest] if height_m > 0.0 else axis_m
    parts = profiles(surface, width_m, axis_m)
    flanks = (fit_flank(name, r[::-1], z[::-1], HEAP_FOOT) for name, (r, z) in parts.items())
    return Slope(axis_m, tuple(flanks))


def residue_slope(surface: Surface, width_m: float, axis_m: Array) -> Slope:
    """Slope of what stays round an outlet, rising away from it; arguments as ``heap_slope``."""
    parts = profiles(surface, width_m, axis_m)
    return Slope(axis_m, tuple(fit_flank(name, r, z) for name, (r, z) in parts.items()))


def walls_touched(surface: Surface, low_m: Array, high_m: Array, depth_m: float) -> list[str]:
    """Names of the box walls that a heap leans on: sand beside them deeper than a depth.

    ``low_m``, ``high_m``, (d - 1,) float64, m: where the walls are. ``depth_m``: single grains that
    rolled there are no heap: about one and a half of the largest.
    """
    names = (("left", "right"), ("front", "back"))
    deep = surface.height_m > depth_m
    touched = []
    for axis, (low, high) in enumerate(zip(low_m, high_m, strict=True)):
        along = surface.point_m[:, axis]
        beside = (along - low < depth_m, high - along < depth_m)
        touched += [name for name, by in zip(names[axis], beside, strict=True) if (by & deep).any()]
    return touched


def connected(surface: Surface, depth_m: float, start: NDArray[np.bool_]) -> NDArray[np.bool_]:
    """Which points of a surface belong to one deep heap with some of them, (m,) bool.

    Deep points that deep neighbours, over gaps of two cells at most, join to a start.

    Parameters
    ----------
    surface : Surface
        As ``free_surface`` gives it: its points are a grid.
    depth_m : float, m
        Sand deeper than this is a heap.
    start : (m,) bool
        Points where the heap begins; only deep ones count.
    """
    from scipy.ndimage import binary_closing, label

    cells = tuple(len(np.unique(along)) for along in surface.point_m.T)
    deep = (surface.height_m > depth_m).reshape(cells)
    # a closing at the edge of the grid needs room beyond it
    closed = binary_closing(np.pad(deep, 1, mode="edge"))[(slice(1, -1),) * len(cells)] | deep
    part, _ = label(closed)
    begun = np.unique(part[start.reshape(cells) & deep])
    joined: NDArray[np.bool_] = (np.isin(part, begun) & deep).ravel()
    return joined
