"""What can be said of a casting's freezing before it is computed.

Heat that the casting must give is compared with what sand takes through its surface: Chvorinov's
rule (Giesserei 27 (1940) 177-186), with the resistance between them, with sand that spreads round
edges and with sand that ends at the box.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Any

import numpy as np
from scipy.ndimage import distance_transform_edt
from scipy.special import erfc, erfcx

from sandmould.arrays import Flags, Floats, Ints
from sandmould.casting.arpm.material import enthalpy_table, thermal
from sandmould.casting.arpm.raster import CASTING, Raster
from sandmould.scenario.casting.curves import Curve, along
from sandmould.scenario.casting.solidification import Solidification

WINDOW = 2.25
"""Radii of the thickest place within which its own volume and surface are counted. With it plans of
squares, bars, plates, a disc, an L, a T and a cross of 10 cells a thickness were 0.83 to 1.45 of
their runs; with 1.5 up to 2.2, with 3 down to 0.64."""
_LATER = 1e-3
"""Share of a time over which the flux is found."""
_MIRRORS = 40
"""Reflections of heat at the box that are added up."""


@dataclass(frozen=True)
class Cooled:
    """A casting as its sand sees it; sides of the box are planes of symmetry."""

    thickest_m: float
    """Radius of the largest circle or sphere in it."""
    modulus_m: float
    """Volume over cooled surface round the thickest place."""
    volume_m3: float
    """Of all of it; m2 in 2D."""
    surface_m2: float
    sand_m3: float

    @property
    def sand_depth_m(self) -> float:
        """Sand over cooled surface."""
        return self.sand_m3 / self.surface_m2 if self.surface_m2 > 0.0 else 0.0


def cooled(raster: Raster, inserts: int = 0) -> Cooled:
    """Volumes and surfaces of a casting on a grid: of the drawing where the grid has its cut."""
    mask, d, cell_m = raster.material == CASTING, raster.material.ndim, raster.cell_m
    sand = ~mask & (raster.material <= CASTING + inserts)
    if mask.all():
        volume_m3 = float(mask.sum()) * cell_m**d
        return Cooled(math.inf, math.inf, volume_m3, 0.0, 0.0)
    volume = np.full(mask.shape, cell_m**d)
    if raster.cut is not None:
        volume.reshape(-1)[raster.cut.cell] *= raster.cut.volume_share
    depth, nearest = distance_transform_edt(mask, return_indices=True)
    # of equally thick places the middle one, which is far from ends
    thickest = np.argwhere(depth >= depth.max() - 1e-9)
    centre = thickest[len(thickest) // 2]
    radius = max(float(depth.max()) - 0.5, 0.5)
    reach2 = (WINDOW * radius + 1.0) ** 2
    near = _away2(np.indices(mask.shape, sparse=True), centre) <= reach2
    surface = _surface_m2(raster, mask)
    # what cools through a surface is what lies nearest to it
    window_m3 = float(volume[mask & (_away2(nearest, centre) <= reach2)].sum())
    of_window = float(surface[near].sum())
    return Cooled(
        thickest_m=radius * cell_m,
        modulus_m=window_m3 / of_window if of_window > 0.0 else math.inf,
        volume_m3=float(volume[mask].sum()),
        surface_m2=float(surface.sum()),
        sand_m3=float(volume[sand].sum()),
    )


def _surface_m2(raster: Raster, mask: Flags) -> Floats:
    """Surface that each cell of the mould cools, in the shape of the grid; m in 2D."""
    found = np.zeros(mask.shape)
    for axis in range(mask.ndim):
        share = np.ones(mask.shape)
        if raster.cut is not None:
            own = raster.cut.axis == axis
            share.reshape(-1)[raster.cut.low[own]] = raster.cut.area_share[own]
        low, high = ((slice(None),) * axis + (part,) for part in (slice(-1), slice(1, None)))
        met = share[low] * (mask[low] != mask[high])
        found[low] += met * ~mask[low]
        found[high] += met * ~mask[high]
    return found * raster.cell_m ** (mask.ndim - 1)


def _away2(place: Any, centre: Ints) -> Any:
    return sum((line - at) ** 2 for line, at in zip(place, centre, strict=True))


def typical(curve: Curve | None, low: float, high: float) -> float:
    """Mean of a curve between two temperatures or times; 0 for none."""
    if curve is None:
        return 0.0
    return (
        float(along(curve, np.linspace(low, high, 100)).mean())
        if isinstance(curve, tuple)
        else curve
    )


def resistance_m2k_w(scenario: Solidification) -> float:
    """Resistance between casting and mould as a plan takes it, with the coating."""
    curve, start = scenario.heat_transfer_w_m2_k, scenario.initial_k
    low, high = start.mould, start.casting
    if scenario.heat_transfer_over == "time" and isinstance(curve, tuple):
        low, high = curve[0][0], curve[-1][0]
    bare = typical(curve, low, high)
    return (1.0 / bare if bare else 0.0) + scenario.coating_m2k_w


def heat_to_lose_j_m3(scenario: Solidification) -> float:
    """Heat of the casting above its solidus: none of one that is poured there."""
    metal, poured_k = thermal(scenario.casting), scenario.initial_k.casting
    table = enthalpy_table([metal], metal.solidus_k, poured_k)
    heat = table.enthalpy_j_m3(np.array([poured_k]), np.zeros(1, dtype=np.int64))[0]
    return max(float(heat - table.rows[0, 1]), 0.0)


def mould_of(scenario: Solidification) -> tuple[float, float]:
    """Conductivity (W/m/K) and heat capacity (J/m3/K) of the mould as it warms to the solidus."""
    low_k, high_k = scenario.initial_k.mould, scenario.casting.solidus_k
    it = thermal(scenario.mould)
    k, density, heat = (
        typical(curve, low_k, high_k)
        for curve in (it.conductivity_w_m_k, it.density_kg_m3, it.heat_capacity_j_kg_k)
    )
    return k, density * heat


def sand_takes_j_m3(scenario: Solidification) -> float:
    """Heat that warms the mould from its start to the solidus."""
    warming_k = scenario.casting.solidus_k - scenario.initial_k.mould
    return mould_of(scenario)[1] * warming_k


def least_sand_share(scenario: Solidification, it: Cooled) -> float:
    """Heat of the casting down to its solidus over what the box's sand can take below it.

    At 1 or more the casting never freezes, however long it is computed: no heat leaves the box.
    """
    if it.sand_m3 <= 0.0:
        return math.inf
    heat = heat_to_lose_j_m3(scenario) * it.volume_m3
    return heat / (sand_takes_j_m3(scenario) * it.sand_m3)


def freezes_s(scenario: Solidification, it: Cooled, depth_m: float = math.inf) -> float:
    """When the thickest place of a casting is solid.

    Infinite where that sand cannot take the heat. ``depth_m``: sand before the box ends; unbounded
    unless given.
    """
    need_j_m2 = heat_to_lose_j_m3(scenario) * it.modulus_m
    if not math.isfinite(need_j_m2) or need_j_m2 >= sand_takes_j_m3(scenario) * depth_m:
        return math.inf
    if need_j_m2 <= 0.0:
        return 0.0
    low_s = high_s = 1e-6

    def is_solid(time_s: float) -> bool:
        return _lacks_j_m2(scenario, it, depth_m, time_s) <= 0.0

    while not is_solid(high_s):
        low_s, high_s = high_s, 2.0 * high_s
        if high_s > 1e12:
            return math.inf
    for _ in range(60):
        middle_s = 0.5 * (low_s + high_s)
        low_s, high_s = (low_s, middle_s) if is_solid(middle_s) else (middle_s, high_s)
    return high_s


def plate_modulus_m(scenario: Solidification, frozen_s: Floats) -> Floats:
    """Modulus of the plate that freezes in the same time as each element, (n,) float64, m.

    Its half thickness, in this mould without end and behind this surface; NaN of metal that is
    poured at its solidus, which no plate keeps.
    """
    known = np.isfinite(frozen_s) & (heat_to_lose_j_m3(scenario) > 0.0)
    last_s = float(frozen_s[known].max(initial=1e-6))
    modulus_m, times_s = [1e-6], [0.0]
    while times_s[-1] < last_s:
        half_m = 1.2 * modulus_m[-1]
        modulus_m.append(half_m)
        times_s.append(freezes_s(scenario, Cooled(half_m, half_m, half_m, 1.0, math.inf)))
    return np.where(known, np.interp(frozen_s, times_s, modulus_m), np.nan)


def _lacks_j_m2(scenario: Solidification, it: Cooled, depth_m: float, time_s: float) -> float:
    """Heat that the casting has still to lose through its surface before its middle is solid."""
    # By then its skin is colder than the solidus, on average by half of what drives the heat.
    metal, poured_k = scenario.casting, scenario.initial_k.casting
    taken = taken_j_m2(scenario, it, depth_m, time_s)
    flux_w_m2 = (taken_j_m2(scenario, it, depth_m, (1.0 + _LATER) * time_s) - taken) / (
        _LATER * time_s
    )
    k, density, heat = (
        typical(curve, metal.solidus_k, poured_k)
        for curve in (metal.conductivity_w_m_k, metal.density_kg_m3, metal.heat_capacity_j_kg_k)
    )
    colder_k = 0.5 * flux_w_m2 * it.thickest_m / k
    skin_j_m3 = density * heat * colder_k
    return (heat_to_lose_j_m3(scenario) + skin_j_m3) * it.modulus_m - taken


def taken_j_m2(scenario: Solidification, it: Cooled, depth_m: float, time_s: float) -> float:
    """Heat that sand has taken through a surface kept at the solidus, J/m2.

    A half space, and beside it what a curved surface adds, g per kelvin, both behind one resistance
    1/h. A half space takes c sqrt(s) per kelvin in Laplace's transform, c^2 = k rho c_p, so that

        Q = h dT (t - h/(g + h) (t - (erfcx(p sqrt(t)) - 1 + 2 p sqrt(t/pi))/p^2)),

    p = (g + h)/c; with g = 0 that is Carslaw and Jaeger, Conduction of Heat in Solids, 2.7. Heat
    that the box throws back is taken off.
    """
    metal, start = scenario.casting, scenario.initial_k
    # half of the metal is solid on the average, and heat has to pass it
    resistance = (
        0.5 * it.thickest_m / typical(metal.conductivity_w_m_k, metal.solidus_k, start.casting)
    )
    h = 1.0 / (resistance + resistance_m2k_w(scenario))
    k, capacity_j_m3_k = mould_of(scenario)
    warming_k = scenario.casting.solidus_k - scenario.initial_k.mould
    curved = min(max(it.thickest_m / it.modulus_m - 1.0, 0.0), 2.0)
    g = 0.5 * k * curved / it.thickest_m
    p = (g + h) / math.sqrt(k * capacity_j_m3_k)
    b = p * math.sqrt(time_s)
    held_back_s = time_s - (float(erfcx(b)) - 1.0 + 2.0 * b / math.sqrt(math.pi)) / p**2
    taken = h * (time_s - h / (g + h) * held_back_s)
    reach_m = math.sqrt(k / capacity_j_m3_k * time_s)
    if math.isfinite(depth_m):
        n = np.arange(1, _MIRRORS)
        x = n * depth_m / reach_m
        back = np.exp(-(x**2)) - math.sqrt(math.pi) * x * erfc(x)
        taken *= max(1.0 + 2.0 * float(np.sum((-1.0) ** n * back)), 0.0)
    return warming_k * taken
