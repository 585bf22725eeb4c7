"""How far sand has bent a pattern, and the sand that lies under it."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from sandmould.geometry.outline import Outline

Array = NDArray[np.float64]
_SAME = 1e-9
"""Distances that differ by less than this share are the same: round-off of a symmetric drawing."""
_COLUMNS = 1000
"""Strips that the space under a pattern is added up from."""


@dataclass(frozen=True)
class Deflection:
    """Displacements of a pattern's outline."""

    tip_m: float
    """How far the farthest corner has sunk; negative where it has risen."""
    largest_m: float
    """Largest displacement of a vertex."""


def farthest_corner(drawn_m: Array, held_m: Array) -> int:
    """Vertex of an outline farthest from what holds it: the tip of the flange of an L.

    Of several the one farthest to the right. ``drawn_m``, (nv, d) float64, m: vertices as drawn.
    ``held_m``, (k, d) float64, m: points that do not move.

    Raises
    ------
    ValueError
        When nothing holds the pattern.
    """
    if not len(held_m):
        raise ValueError("points that hold the pattern are 0, valid is at least 1")
    away_m = np.linalg.norm(drawn_m[:, None] - held_m, axis=2).min(axis=1)
    farthest = np.flatnonzero(away_m >= (1.0 - _SAME) * away_m.max())
    return int(farthest[drawn_m[farthest, 0].argmax()])


def deflection(drawn_m: Array, now_m: Array, tip: int) -> Deflection:
    """Displacements of an outline; the vertical axis is the last one.

    ``drawn_m``, ``now_m``, (nv, d) float64, m: vertices as drawn, and where they are. ``tip``:
    vertex of the farthest corner.
    """
    moved_m = now_m - drawn_m
    largest_m = float(np.linalg.norm(moved_m, axis=1).max())
    return Deflection(-float(moved_m[tip, -1]), largest_m)


def fill_under(outline_m: Array, position_m: Array, radius_m: Array) -> float:
    """Share of the space straight under a pattern, down to y = 0, that discs fill; NaN without one.

    Discs count whole where their centre lies there: the paper's low density under a flange.

    Parameters
    ----------
    outline_m : (nv, 2) float64, m
        Closed, counter-clockwise.
    position_m : (n, 2) float64, m
    radius_m : (n,) float64, m
    """
    left_m, right_m = outline_m[:, 0].min(), outline_m[:, 0].max()
    width_m = (right_m - left_m) / _COLUMNS
    x = left_m + width_m * (np.arange(_COLUMNS) + 0.5)
    solid_m2 = Outline("pattern", outline_m).measure
    under_m2 = width_m * float(np.nanmax(_heights_m(outline_m, x), axis=0).sum()) - solid_m2
    if not under_m2 > _SAME * solid_m2:
        return np.nan
    with np.errstate(invalid="ignore"):
        above = (_heights_m(outline_m, position_m[:, 0]) > position_m[:, 1]).sum(axis=0)
    # A point in the solid has an odd number of sides above it, one under it two or more.
    under = (above > 0) & (above % 2 == 0)
    return float(np.pi * (radius_m[under] ** 2).sum() / under_m2)


def _heights_m(outline_m: Array, x_m: Array) -> Array:
    """Where upright lines cross each side, (nv, k) float64, m; NaN where they do not."""
    end_m = np.roll(outline_m, -1, axis=0)
    (x, y), (x_end, y_end) = outline_m.T[..., None], end_m.T[..., None]
    with np.errstate(divide="ignore", invalid="ignore"):
        share = (x_m - x) / (x_end - x)
    # Half open to the right, so that a line through a corner crosses one of its two sides.
    crossed = (np.minimum(x, x_end) <= x_m) & (x_m < np.maximum(x, x_end))
    return np.where(crossed, y + share * (y_end - y), np.nan)
