"""Properties over temperature: curves, and the usual laws for what of a metal is solid."""

from __future__ import annotations

import math
from collections.abc import Sequence
from itertools import pairwise

import numpy as np

from sandmould.arrays import Floats

Curve = float | tuple[tuple[float, float], ...]
"""A number, or pairs of a temperature (K) or time (s) and a value; linear between two pairs, and as
in the nearest one beyond them."""
QUARTZ_KG_M3 = 2650.0
QUARTZ_W_M_K = ((300.0, 7.7), (800.0, 3.2), (1300.0, 2.2))
AIR_W_M_K = ((300.0, 0.0263), (800.0, 0.0573), (1300.0, 0.0837))
"""But for air at 300 K from memory: their sources were not seen."""
POINTS = 400
"""Of a law between solidus and liquidus."""


def along(curve: Curve, place: Floats) -> Floats:
    """Values of a curve at temperatures or times, (n,) float64."""
    if isinstance(curve, tuple):
        return np.interp(place, *np.transpose(curve))
    return np.full(len(place), curve, dtype=np.float64)


def ends(curve: Curve) -> tuple[float, float]:
    """Least and largest value of a curve."""
    values = [value for _, value in curve] if isinstance(curve, tuple) else [curve]
    return min(values), max(values)


def curve_fault(curve: Curve) -> str:
    """What a curve must be and is not; empty for a good one."""
    if isinstance(curve, tuple):
        places = [place for place, _ in curve]
        if len(curve) < 2 or any(b <= a for a, b in pairwise(places)):
            return "two or more pairs whose first numbers rise"
    low, high = ends(curve)
    valid = "pairs with second numbers" if isinstance(curve, tuple) else "a number"
    return "" if 0.0 < low <= high < math.inf else f"{valid} greater than 0"


def fraction_fault(
    fraction: Sequence[tuple[float, float]], solidus_k: float, liquidus_k: float
) -> str:
    """What a table of solid fractions must be and is not; empty for a good one."""
    places, values = np.transpose(fraction) if len(fraction) > 1 else np.zeros((2, 2))
    if (np.diff(places) <= 0.0).any() or (places[0], places[-1]) != (solidus_k, liquidus_k):
        span = f"solidus_k {solidus_k:g} to liquidus_k {liquidus_k:g}"
        return f"pairs whose temperatures rise from {span}"
    if (np.diff(values) > 0.0).any() or values[0] > 1.0 or values[-1] != 0.0:
        return "fractions from at most 1 at the solidus that fall, or stay, to 0 at the liquidus"
    return ""


def solid_fractions(
    law: str, solidus_k: float, liquidus_k: float, melting_k: float, partition: float
) -> tuple[tuple[float, float], ...]:
    """Solid fraction over temperature of a binary alloy with a straight liquidus.

    By the lever rule solid and liquid are of one composition each; by Scheil's (Zeitschrift fuer
    Metallkunde 34 (1942) 70-72) nothing diffuses in the solid. What is left at the solidus, that
    of the eutectic, freezes there.

    Gives pairs of temperature (K) and fraction; none for a straight line. ``law``: ``line``,
    ``lever`` or ``scheil``. ``melting_k``: of the pure metal. ``partition``: solute in the solid
    over that in the liquid beside it.
    """
    if law == "line":
        return ()
    at = np.linspace(solidus_k, liquidus_k, POINTS)
    below = (melting_k - at) / (melting_k - liquidus_k)
    if law == "scheil":
        solid = 1.0 - below ** (1.0 / (partition - 1.0))
    else:
        solid = (1.0 - 1.0 / below) / (1.0 - partition)
    solid = np.clip(solid, 0.0, 1.0)
    solid[-1] = 0.0
    return tuple(zip(at.tolist(), solid.tolist(), strict=True))


def packed_w_m_k(solid_fraction: float) -> Curve:
    """Conductivity of dry quartz sand over temperature, without radiation between its grains.

    Zehner and Schluender, Chemie Ingenieur Technik 42 (1970) 933-941: round grains, in whose unit
    cell heat passes grain and gas in parallel.
    """
    at = np.linspace(300.0, 1300.0, 41)
    gas = along(AIR_W_M_K, at)
    found = gas * packed_over_gas(gas / along(QUARTZ_W_M_K, at), solid_fraction)
    return tuple(zip(at.tolist(), found.tolist(), strict=True))


def packed_over_gas(gas_over_grain: Floats, solid_fraction: float) -> Floats:
    """Conductivity of a packing over that of its gas, by that of the gas over that of a grain."""
    n, form = gas_over_grain, 1.25 * (solid_fraction / (1.0 - solid_fraction)) ** (10.0 / 9.0)
    rest = 1.0 - n * form
    cell = (1.0 - n) * form / rest**2 * np.log(1.0 / (n * form))
    cell += -0.5 * (form + 1.0) - (form - 1.0) / rest
    root = math.sqrt(solid_fraction)
    return np.asarray(1.0 - root + 2.0 * root / rest * cell)
