"""How far sand has bent a pattern, and the sand that lies under it."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]
_SAME = 1e-9
"""Distances that differ by less than this share are the same: round-off of a symmetric drawing."""


@dataclass(frozen=True)
class Deflection:
    """Displacements of a pattern's outline."""

    tip_m: float
    """How far the farthest corner has sunk; negative where it has risen."""
    largest_m: float
    """Largest displacement of a vertex."""


def farthest_corner(drawn_m: Array, held_m: Array) -> int:
    """Vertex of an outline farthest from what holds it: the tip of the flange of an L.

    Of several the one farthest to the right.

    Parameters
    ----------
    drawn_m : (nv, d) float64, m
        Vertices as drawn.
    held_m : (k, d) float64, m
        Points that do not move.

    Returns
    -------
    int

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

    Parameters
    ----------
    drawn_m, now_m : (nv, d) float64, m
        Vertices as drawn, and where they are.
    tip : int
        Vertex of the farthest corner.

    Returns
    -------
    Deflection
    """
    moved_m = now_m - drawn_m
    largest_m = float(np.linalg.norm(moved_m, axis=1).max())
    return Deflection(-float(moved_m[tip, -1]), largest_m)


def under_outline(outline_m: Array, position_m: Array) -> NDArray[np.bool_]:
    """Which points have a part of a closed outline straight above them.

    Parameters
    ----------
    outline_m : (nv, 2) float64, m
        Counter-clockwise.
    position_m : (n, 2) float64, m
        Points outside it.

    Returns
    -------
    (n,) bool
    """
    start_m, end_m = outline_m, np.roll(outline_m, -1, axis=0)
    # The solid lies left of an edge, so it lies above those that lead to the right.
    down = end_m[:, 0] > start_m[:, 0]
    (x, y), (x_end, y_end) = start_m[down].T[..., None], end_m[down].T[..., None]
    at_x, at_y = position_m.T
    share = (at_x - x) / (x_end - x)
    above = (share >= 0.0) & (share < 1.0) & (y + share * (y_end - y) > at_y)
    return np.asarray(above.any(axis=0))
