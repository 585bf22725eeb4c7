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
from scipy.ndimage import distance_transform_edt, gaussian_filter
from scipy.special import erfc, erfcx

from sandmould.arrays import Ints
from sandmould.casting.arpm.raster import MOULD, Raster
from sandmould.scenario.casting.solidification import Solidification

WINDOW = 1.5
"""Radii of the thickest place within which its own volume and surface are counted: a square's
corners are still in it."""
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


def cooled(raster: Raster) -> Cooled:
    """Volumes and surfaces of a casting on a grid; the surface is that of the smoothed cells.

    Volumes are those of the elements: of the drawing where the grid has its cut.
    """
    mask, d, cell_m = raster.material != MOULD, raster.material.ndim, raster.cell_m
    smooth = gaussian_filter(mask.astype(np.float64), 1.0, mode="nearest")
    slopes = [np.gradient(smooth, axis=k) for k in range(d) if mask.shape[k] > 1]
    surface = np.sqrt(np.sum(np.square(slopes), axis=0)) * cell_m ** (d - 1)
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
    # what cools through a surface is what lies nearest to it
    window_m3 = float(volume[mask & (_away2(nearest, centre) <= reach2)].sum())
    of_window = float(surface[near].sum())
    return Cooled(
        thickest_m=radius * cell_m,
        modulus_m=window_m3 / of_window if of_window > 0.0 else math.inf,
        volume_m3=float(volume[mask].sum()),
        surface_m2=float(surface.sum()),
        sand_m3=float(volume[~mask].sum()),
    )


def _away2(place: Any, centre: Ints) -> Any:
    """Squared distances of cells from one of them."""
    return sum((line - at) ** 2 for line, at in zip(place, centre, strict=True))


def heat_to_lose_j_m3(scenario: Solidification) -> float:
    """Superheat and latent heat of the casting."""
    metal = scenario.casting
    superheat_k = scenario.initial_k.casting - metal.solidus_k
    return metal.density_kg_m3 * (metal.latent_heat_j_kg + metal.heat_capacity_j_kg_k * superheat_k)


def sand_takes_j_m3(scenario: Solidification) -> float:
    """Heat that warms the mould from its start to the solidus."""
    mould = scenario.mould
    warming_k = scenario.casting.solidus_k - scenario.initial_k.mould
    return mould.density_kg_m3 * mould.heat_capacity_j_kg_k * warming_k


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

    Parameters
    ----------
    scenario : Solidification
    it : Cooled
    depth_m : float, m
        Sand before the box ends; unbounded unless given.

    Returns
    -------
    float, s
        Infinite where that sand cannot take the heat.
    """
    need_j_m2 = heat_to_lose_j_m3(scenario) * it.modulus_m
    if not math.isfinite(need_j_m2) or need_j_m2 >= sand_takes_j_m3(scenario) * depth_m:
        return math.inf
    low_s = high_s = 1e-6
    while taken_j_m2(scenario, it, depth_m, high_s) < need_j_m2:
        low_s, high_s = high_s, 2.0 * high_s
        if high_s > 1e12:
            return math.inf
    for _ in range(60):
        middle_s = 0.5 * (low_s + high_s)
        if taken_j_m2(scenario, it, depth_m, middle_s) < need_j_m2:
            low_s = middle_s
        else:
            high_s = middle_s
    return high_s


def taken_j_m2(scenario: Solidification, it: Cooled, depth_m: float, time_s: float) -> float:
    """Heat that sand has taken through a surface kept at the solidus, J/m2.

    A half space behind a resistance (Carslaw and Jaeger, Conduction of Heat in Solids, 2.7), more
    round a curved surface, less where heat is thrown back by the box.
    """
    mould, transfer = scenario.mould, scenario.heat_transfer_w_m2_k
    # half of the metal is solid on the average, and heat has to pass it
    resistance = 0.5 * it.thickest_m / scenario.casting.conductivity_w_m_k
    h = 1.0 / (resistance + (1.0 / transfer if transfer else 0.0))
    k = mould.conductivity_w_m_k
    diffusivity = k / (mould.density_kg_m3 * mould.heat_capacity_j_kg_k)
    warming_k = scenario.casting.solidus_k - scenario.initial_k.mould
    reach_m = math.sqrt(diffusivity * time_s)
    b = h * reach_m / k
    taken = k * k / (h * diffusivity) * (float(erfcx(b)) - 1.0 + 2.0 * b / math.sqrt(math.pi))
    curved = min(max(it.thickest_m / it.modulus_m - 1.0, 0.0), 2.0)
    taken += 0.5 * k * time_s * curved / it.thickest_m
    if math.isfinite(depth_m):
        n = np.arange(1, _MIRRORS)
        x = n * depth_m / reach_m
        back = np.exp(-(x**2)) - math.sqrt(math.pi) * x * erfc(x)
        taken *= max(1.0 + 2.0 * float(np.sum((-1.0) ** n * back)), 0.0)
    return warming_k * taken
