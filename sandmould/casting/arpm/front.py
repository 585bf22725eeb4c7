"""When the front passes the middle of each element, from when each was solid as a whole.

A metal that melts at one temperature freezes behind a front, and an element is below its solidus
when the front leaves it. Its middle froze half an element before: when half of its latent heat was
gone (Voller and Cross, International Journal of Heat and Mass Transfer 24 (1981) 545-556). Where
liquidus and solidus differ, an element cools through its solidus as its middle does.
"""

from __future__ import annotations

import numpy as np
from scipy.spatial import cKDTree

from sandmould.arrays import Floats
from sandmould.casting.arpm.elements import Elements
from sandmould.casting.arpm.filling import Filling

REACH = 1.6
"""Mean sizes of two elements within which the front goes from one to the other."""


def middle_frozen_s(elements: Elements, filling: Filling, frozen_s: Floats) -> Floats:
    """Interpolate freezing times to the elements' middles.

    Parameters
    ----------
    elements : Elements
    filling : Filling
    frozen_s : (n,) float64, s
        When each element's mean enthalpy fell below its solidus; NaN before.

    Returns
    -------
    (n,) float64, s
        The same for alloys, and for an element that freezes later than all those round it.
    """
    at_once = np.array([it.melts and it.solidus_k == it.liquidus_k for it in filling.materials])
    frozen = np.flatnonzero(np.isfinite(frozen_s) & at_once[elements.material])
    found = frozen_s.copy()
    if len(frozen):
        size_m, own_s = elements.size_m[frozen], frozen_s[frozen]
        later_s_m = _later_s_m(elements.position_m[frozen], size_m, own_s)
        found[frozen] = np.maximum(own_s - 0.5 * size_m * later_s_m, 0.0)
    return found


def _later_s_m(place_m: Floats, size_m: Floats, frozen_s: Floats) -> Floats:
    """Seconds a metre that the front takes from each element to the next, 0 where it ends."""
    count = min(3 ** place_m.shape[1], len(place_m))
    found = cKDTree(place_m).query(place_m, k=count)
    away, near = (np.asarray(values).reshape(-1, count) for values in found)
    there = (away > 0.0) & (away <= REACH * 0.5 * (size_m[:, None] + size_m[near]))
    slope = (frozen_s[near] - frozen_s[:, None]) / np.where(there, away, np.inf)
    return np.asarray(np.maximum(slope.max(axis=1), 0.0))
