"""What a head-on impact comes to, eqs. (15)-(21), total force clipped."""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

from sandmould.arrays import Floats
from tests.verification.cases import closed_forms


class Impacts(NamedTuple):
    """What impacts come to, each (n,) float64; or the exact values."""

    restitution: Floats
    peak_overlap: Floats
    """Over v sqrt(m/k)."""
    contact_time: Floats
    """From the first touch to where the force, linear between steps, vanishes; over sqrt(m/k)."""


def exact(damping_ratio: float) -> Impacts:
    """Solution of u'' + 2 zeta u' + u = 0 from u = 0 and u' = 1 to where its force vanishes."""
    z = damping_ratio
    w = math.sqrt(1.0 - z * z)
    peak = math.exp(-z / w * math.atan2(w, z)) if w else math.exp(-1.0)
    values = (
        closed_forms.restitution(z, "total"),
        peak,
        closed_forms.contact_time_s(1.0, z, "total"),
    )
    return Impacts(*(np.array(x) for x in values))
