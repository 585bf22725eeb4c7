"""When the front passes the middle of each element, from when each was solid as a whole.

A metal that melts at one temperature freezes behind a front, and an element is below its solidus
when the front leaves it. Its middle froze half an element before: when half of its latent heat was
gone (Voller and Cross, International Journal of Heat and Mass Transfer 24 (1981) 545-556). Where
liquidus and solidus differ, an element cools through its solidus as its middle does.

There the gradient of temperature is read as well. Where a temperature is passed at t(x) and falls
at the rate R there, its gradient is R times that of t.
"""

from __future__ import annotations

import numpy as np
from scipy.spatial import cKDTree

from sandmould.arrays import Flags, Floats, Ints
from sandmould.casting.arpm.elements import Elements
from sandmould.casting.arpm.filling import Filling

REACH = 1.6
"""Mean sizes of two elements within which the front goes from one to the other."""


def middle_frozen_s(elements: Elements, filling: Filling, frozen_s: Floats) -> Floats:
    """Interpolate freezing times to the elements' middles, (n,) float64, s.

    The same for alloys, and for an element that freezes later than all those round it.
    ``frozen_s``, (n,) float64, s: when each element's mean enthalpy fell below its solidus; NaN
    before.
    """
    at_once = np.array([it.melts and it.solidus_k == it.liquidus_k for it in filling.materials])
    frozen = np.flatnonzero(np.isfinite(frozen_s) & at_once[elements.material])
    found = frozen_s.copy()
    if len(frozen):
        size_m, own_s = elements.size_m[frozen], frozen_s[frozen]
        later_s_m = _later_s_m(elements.position_m[frozen], size_m, own_s)
        found[frozen] = np.maximum(own_s - 0.5 * size_m * later_s_m, 0.0)
    return found


def gradient_k_m(elements: Elements, noted: Floats) -> Floats:
    """Temperature gradient at each element when it passes where gradients are read.

    Gives (n,) float64, K/m; NaN where nothing was read. ``noted``, (3, n) float64: as of ``Heat``.
    """
    _, read_s, cooling_k_s = noted
    there = np.flatnonzero(np.isfinite(read_s))
    found = np.full(len(read_s), np.nan)
    if len(there):
        place_m, own_s = elements.position_m[there], read_s[there]
        away_m, near, touches = _near(place_m, elements.size_m[there])
        apart = (place_m[near] - place_m[:, None]) * touches[:, :, None]
        # least squares of straight lines, those of near elements first
        weight = 1.0 / np.where(touches, away_m, np.inf) ** 2
        squares = np.einsum("nk,nki,nkj->nij", weight, apart, apart)
        rises = np.einsum("nk,nki,nk->ni", weight, apart, own_s[near] - own_s[:, None])
        # a plate one element thick has no slope across it
        slope_s_m = np.einsum("nij,nj->ni", np.linalg.pinv(squares, 1e-9, hermitian=True), rises)
        found[there] = cooling_k_s[there] * np.linalg.norm(slope_s_m, axis=1)
    return found


def _later_s_m(place_m: Floats, size_m: Floats, frozen_s: Floats) -> Floats:
    """Seconds a metre that the front takes from each element to the next, 0 where it ends."""
    away_m, near, touches = _near(place_m, size_m)
    slope = (frozen_s[near] - frozen_s[:, None]) / np.where(touches, away_m, np.inf)
    return np.asarray(np.maximum(slope.max(axis=1), 0.0))


def _near(place_m: Floats, size_m: Floats) -> tuple[Floats, Ints, Flags]:
    """Distances of the elements round each, their numbers, and which of them it touches."""
    count = min(3 ** place_m.shape[1], len(place_m))
    found = cKDTree(place_m).query(place_m, k=count)
    away_m, near = (np.asarray(values).reshape(-1, count) for values in found)
    touches = (away_m > 0.0) & (away_m <= REACH * 0.5 * (size_m[:, None] + size_m[near]))
    return away_m, near, touches
