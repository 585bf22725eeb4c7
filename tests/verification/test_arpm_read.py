"""What a foundry reads of freezing metal: gradient, cooling rate, Niyama's value, a corner."""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import NamedTuple

import numpy as np
import pytest
from scipy.optimize import brentq
from scipy.special import erf, erfc, erfinv

from sandmould.arrays import Floats
from sandmould.casting.arpm.computation import gradient_k_m, middle_frozen_s
from sandmould.casting.arpm.elements import placed
from sandmould.casting.arpm.filling import Filling
from sandmould.casting.arpm.material import ThermalMaterial
from sandmould.casting.arpm.method import HeatMethod
from sandmould.casting.arpm.raster import Raster
from sandmould.casting.arpm.solidification import solidify

SOLIDUS, LIQUIDUS, POURED, COLD = 821.0, 921.0, 960.0, 300.0
DIE = ThermalMaterial("die", 7800.0, 500.0, 45.0)
METAL = ThermalMaterial("metal", 2600.0, 1000.0, 100.0, 390e3, SOLIDUS, LIQUIDUS)


class Pass(NamedTuple):
    """Where a half space passes a temperature, over the root of time, and its slope there."""

    eta: float
    slope: float
    """dT/d eta, K s^0.5/m."""


def exact_pass(temperature_k: float) -> Pass:
    """Metal with a straight freezing range on a cold half space, both without end.

    All depends on eta = x/sqrt(t). Die, solid, mush and liquid each have a constant diffusivity,
    so each is an error function; heat flux is continuous, as nothing freezes at once.
    """
    k, heat = 100.0, 2600.0 * 1000.0
    wide = LIQUIDUS - SOLIDUS
    solid, mush = (2.0 * math.sqrt(k / c) for c in (heat, heat + 2600.0 * 390e3 / wide))
    die = 2.0 * math.sqrt(45.0 / (7800.0 * 500.0))

    def parts(surface_k: float) -> tuple[float, float, float, float]:
        """Amplitude and end of the solid, and of the mush."""
        of_solid = 45.0 * (surface_k - COLD) / die * solid / k
        eta_s = solid * _inverse((SOLIDUS - surface_k) / of_solid)
        of_mush = _slope(of_solid, solid, eta_s) / _slope(1.0, mush, eta_s)
        eta_l = mush * _inverse(float(erf(eta_s / mush)) + wide / of_mush)
        return of_solid, eta_s, of_mush, eta_l

    def misfit(surface_k: float) -> float:
        _, _, of_mush, eta_l = parts(surface_k)
        of_liquid = (POURED - LIQUIDUS) / float(erfc(eta_l / solid))
        return _slope(of_mush, mush, eta_l) - _slope(of_liquid, solid, eta_l)

    # where the mush has an end at all
    tried = np.linspace(COLD + 50.0, SOLIDUS - 1.0, 4000)
    values = np.array([_or_nan(misfit, each) for each in tried])
    turn = np.flatnonzero(values[:-1] * values[1:] < 0.0)[0]
    surface_k = brentq(misfit, tried[turn], tried[turn + 1])
    _, eta_s, of_mush, _ = parts(surface_k)
    eta = mush * _inverse(float(erf(eta_s / mush)) + (temperature_k - SOLIDUS) / of_mush)
    return Pass(eta, _slope(of_mush, mush, eta))


def _slope(amplitude: float, scale: float, eta: float) -> float:
    return amplitude * 2.0 / math.sqrt(math.pi) / scale * math.exp(-((eta / scale) ** 2))


def _inverse(value: float) -> float:
    if not -1.0 < value < 1.0:
        raise ValueError("no end")
    return float(erfinv(value))


def _or_nan(function: Callable[[float], float], value: float) -> float:
    try:
        return float(function(value))
    except ValueError:
        return math.nan


def half_space(
    cells: int, fraction: float, method: HeatMethod | None = None
) -> tuple[Floats, Floats, Floats]:
    """Depth, gradient and cooling rate of 120 mm of metal on as much die; cells in 20 mm."""
    cell_m = 0.02 / cells
    material = np.repeat(np.repeat([0, 1], [6 * cells, 6 * cells])[:, None], 2, axis=1)
    raster = Raster(material, cell_m, np.zeros(2))
    filling = Filling((DIE, METAL), (COLD, POURED), read_at=fraction)
    elements = placed(raster)
    marching = (method or HeatMethod("faces")).marching(elements, filling, raster)
    # by then heat has not come back from the ends: the exact temperatures there are 0.01 K off
    noted = solidify(elements, filling, marching, record_s=0.5, until_s=16.0).heat.noted
    metal = elements.material == 1
    depth_m = elements.position_m[metal, 0] - 0.12
    return depth_m, gradient_k_m(elements, noted)[metal], noted[2][metal]


@pytest.mark.parametrize(("fraction", "most"), [(0.7, 0.035), (0.3, 0.006)])
def test_niyama_of_a_half_space_is_the_same_everywhere(fraction: float, most: float) -> None:
    it = exact_pass(LIQUIDUS - fraction * (LIQUIDUS - SOLIDUS))
    exact = math.sqrt(2.0 * it.slope / it.eta)
    errors = []
    for cells in (20, 40):
        depth_m, steep, cooling = half_space(cells, fraction)
        there = (depth_m > 0.004) & (depth_m < 0.01)
        when_s = (depth_m[there] / it.eta) ** 2
        errors.append(np.abs(steep / np.sqrt(cooling) / exact - 1.0)[there].max())
        # the worst is nearest to the die, four or eight elements from it: 2.7, 1.7 and 0.3, 0.3 %
        assert errors[-1] < most
        # 4.7 and 4.0 %
        np.testing.assert_allclose(steep[there], it.slope / np.sqrt(when_s), rtol=0.06)
        np.testing.assert_allclose(cooling[there], it.slope * it.eta / when_s / 2.0, rtol=0.06)
    assert errors[1] < max(0.8 * errors[0], 0.004)


@pytest.mark.parametrize("method", [
    HeatMethod("faces", stepping="explicit"), HeatMethod("faces", stepping="super"),
    HeatMethod("difference"),
])  # fmt: skip
def test_all_steps_read_alike(method: HeatMethod) -> None:
    depth_m, steep, cooling = half_space(10, 0.7)
    _, steep_too, cooling_too = half_space(10, 0.7, method)
    # super steps are as long as what is nearer to the die takes to freeze; 1.3 % measured
    there = (depth_m > 0.006) & np.isfinite(steep) & np.isfinite(steep_too)
    assert there.any()
    off = (steep_too / np.sqrt(cooling_too)) / (steep / np.sqrt(cooling)) - 1.0
    assert np.abs(off[there]).max() < 0.02


def test_metal_that_melts_at_one_temperature_has_no_niyama() -> None:
    pure = ThermalMaterial("pure", 2600.0, 1000.0, 100.0, 390e3, 900.0, 900.0)
    assert math.isnan(pure.read_k(0.7))
    # what is left at the solidus freezes without cooling: it is read a tenth of the range above
    eutectic = ThermalMaterial("eutectic", 2600.0, 1000.0, 100.0, 390e3, SOLIDUS, LIQUIDUS,
                               ((SOLIDUS, 0.4), (LIQUIDUS, 0.0)))  # fmt: skip
    assert eutectic.read_k(0.7) == pytest.approx(SOLIDUS + 0.1 * (LIQUIDUS - SOLIDUS))
    assert METAL.read_k(0.7) == pytest.approx(LIQUIDUS - 70.0, abs=1e-9)


LATENT, HOT = 0.25, 0.3
"""Over the heat and the step of temperature between the melting point and the walls."""
CURVE_C, CURVE_M = 0.159, 5.02
"""Rathjen and Jiji (1971) at these two numbers: from memory, the paper was not seen."""
PLACES = (1.0, 1.25, 1.5, 2.0)
"""Rays from the corner along which the front is compared: x over y."""


def flat_front() -> float:
    """Neumann's front on one wall over 2 sqrt(alpha t)."""

    def misfit(s: float) -> float:
        flux = math.exp(-(s**2)) * (1.0 / erf(s) - HOT / erfc(s))
        return float(flux - s * math.sqrt(math.pi) * LATENT)

    return float(brentq(misfit, 0.1, 2.0))


def on_the_curve(front: float, over: float) -> float:
    """y* of the front where x* is so many times y*: of their curve round a corner."""

    def misfit(y: float) -> float:
        return (y**CURVE_M - front**CURVE_M) * ((over * y) ** CURVE_M - front**CURVE_M) - CURVE_C

    return float(brentq(misfit, front, 2.0))


def plain_corner(cells: int) -> Floats:
    """When the front passes cells, in cell^2/alpha, by plain finite volumes of its own."""
    heat = np.full((2 * cells, 2 * cells), HOT + LATENT)
    passed, dt, middle = np.full(heat.shape, np.nan), 0.2, 0.5 * LATENT
    for step in range(int(2.8 * cells**2)):
        warm = np.where(heat > LATENT, heat - LATENT, np.minimum(heat, 0.0))
        round_it = np.pad(warm, 1, mode="edge")
        round_it[0, :], round_it[:, 0] = -2.0 - round_it[1, :], -2.0 - round_it[:, 1]
        taken = round_it[2:, 1:-1] + round_it[:-2, 1:-1] + round_it[1:-1, 2:]
        before, heat = heat, heat + dt * (taken + round_it[1:-1, :-2] - 4.0 * warm)
        # the front is in the middle when half of the latent heat is gone
        now = (before >= middle) & (heat < middle)
        passed[now] = (step + (before - middle)[now] / (before - heat)[now]) * dt
    return passed


def corner(cells: int) -> Floats:
    """The same by elements."""
    material = np.ones((2 * cells + 1, 2 * cells + 1), dtype=np.int64)
    material[0], material[:, 0] = 0, 0
    raster = Raster(material, 1e-3, np.zeros(2))
    cold = ThermalMaterial("cold", 1e9, 1e3, 1e9)
    metal = ThermalMaterial("metal", 1e3, 1e3, 10.0, LATENT * 600e3, 900.0, 900.0)
    filling = Filling((cold, metal), (300.0, 900.0 + HOT * 600.0))
    elements = placed(raster)
    marching = HeatMethod("faces").marching(elements, filling, raster)
    found = solidify(elements, filling, marching, record_s=5.0, until_s=0.055 * cells**2)
    passed_s = middle_frozen_s(elements, filling, found.heat.frozen_s)
    return passed_s.reshape(material.shape)[1:, 1:] / 0.1


def off_the_curve(passed: Floats) -> Floats:
    """Mean error of the front's distance from the corner on each ray."""
    front, middle, off = flat_front(), np.arange(len(passed)) + 0.5, []
    for over in PLACES:
        # neither where few elements have frozen nor where the box ends
        rows = np.flatnonzero((middle > 0.15 * len(passed)) & (over * middle < 0.65 * len(passed)))
        when = np.array([np.interp(over * middle[j], middle, passed[:, j]) for j in rows])
        y = middle[rows] / np.sqrt(4.0 * when)
        off.append(float(y.mean()) / on_the_curve(front, over) - 1.0)
    return np.array(off)


def test_the_front_in_a_corner() -> None:
    assert flat_front() == pytest.approx(0.70766, abs=5e-6)
    # finite volumes of our own bear C and m out: errors of 0.2 to 1.0 % fall by 1.6 to 2.2 here and
    # by 1.5 to 1.8 to 64 cells; 0.03 % is left on the diagonal, 0.5 % where x is twice y
    coarse, fine = (off_the_curve(plain_corner(cells)) for cells in (16, 32))
    plain = fine + (fine - coarse) / 1.4
    assert abs(plain[0]) < 2e-3
    assert np.abs(plain).max() < 7e-3
    # an element freezes as a whole, so half of its latent heat tells when: 1.7 and 0.6 % measured
    coarse, fine = (np.abs(off_the_curve(corner(cells))) for cells in (16, 32))
    assert coarse.max() < 0.02
    assert fine.max() < 0.01
    assert (fine < 0.55 * coarse).all()
