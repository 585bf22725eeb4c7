"""A round bar or a ball that freezes in its mould: finite volumes along the radius alone.

It shares no code with the solver but the compiler. ``tests/verification/test_arpm_drawn.py`` checks
that it converges and that it meets the closed form of a casting without gradients.
"""

from __future__ import annotations

import math

import numpy as np

from sandmould.arrays import Floats
from sandmould.casting.arpm.filling import Filling
from sandmould.compiled import njit


def radial_frozen_s(
    filling: Filling, radius_m: float, outer_m: float, dimensions: int, shells: int
) -> tuple[Floats, Floats]:
    """When each shell of the casting fell below its solidus.

    Parameters
    ----------
    filling : Filling
        Of mould and metal.
    radius_m, outer_m : float, m
        Of the casting, and of the mould, which no heat leaves.
    dimensions : int
        2 for a bar, 3 for a ball.
    shells : int
        Of the casting; the mould has as many, which grow outwards.

    Returns
    -------
    place_m, frozen_s : (shells,) float64, m and s
    """
    mould, metal = filling.materials
    growth, ratio = (1.0, 1.5), (outer_m - radius_m) * shells / radius_m
    for _ in range(100):
        middle = 0.5 * sum(growth)
        long = sum(middle**k for k in range(shells)) > ratio
        growth = (growth[0], middle) if long else (middle, growth[1])
    width = radius_m / shells * np.concatenate([np.ones(shells), growth[0] ** np.arange(shells)])
    edge = np.concatenate([[0.0], np.cumsum(width)])
    place = 0.5 * (edge[1:] + edge[:-1])
    of_metal = np.arange(2 * shells) < shells
    half = 0.5 * width / np.where(of_metal, metal.conductivity_w_m_k, mould.conductivity_w_m_k)
    path = half[:-1] + half[1:]
    path[shells - 1] += filling.resistance_m2k_w
    volume = np.diff(edge**dimensions) / dimensions
    through = edge[1:-1] ** (dimensions - 1) / path
    capacity = np.where(of_metal, metal.capacity_j_m3_k, mould.capacity_j_m3_k)
    around = np.append(through, 0.0) + np.insert(through, 0, 0.0)
    step_s = 0.9 * float((capacity * volume / around).min())
    start_k = np.where(of_metal, filling.initial_k[1], filling.initial_k[0])
    melting = (metal.solidus_k, metal.liquidus_k, metal.density_kg_m3 * metal.latent_heat_j_kg)
    frozen = _march(step_s, through, volume, capacity, shells, start_k, melting)
    return place[:shells], frozen


@njit()
def _march(
    step_s: float, through: Floats, volume: Floats, capacity: Floats, shells: int, start_k: Floats,
    melting: tuple[float, float, float],
) -> Floats:  # fmt: skip
    solidus, liquidus, latent = melting
    n = len(volume)
    low = capacity[0] * solidus
    high = capacity[0] * liquidus + latent
    now = start_k.copy()
    heat = capacity * start_k
    heat[:shells] += latent
    flow, frozen, left, time = np.zeros(n + 1), np.full(shells, np.nan), shells, 0.0
    while left > 0 and time < 1e5:
        flow[1:n] = through * (now[:-1] - now[1:])
        for i in range(n):
            before = heat[i]
            heat[i] = before + step_s * (flow[i] - flow[i + 1]) / volume[i]
            if i >= shells or heat[i] < low:
                now[i] = heat[i] / capacity[i]
            elif heat[i] < high:
                now[i] = solidus + (heat[i] - low) / (high - low) * (liquidus - solidus)
            else:
                now[i] = (heat[i] - latent) / capacity[i]
            if i < shells and before >= low > heat[i]:
                frozen[i] = time + step_s * (before - low) / (before - heat[i])
                left -= 1
        time += step_s
    return frozen


def lumped_s(filling: Filling, volume_over_area_m: float) -> float:
    """Closed form of a casting without gradients in a mould that stays cold; for Bi below 0.02."""
    mould_k = filling.initial_k[0]
    metal = filling.materials[1]
    mushy = metal.liquidus_k - metal.solidus_k
    c = metal.capacity_j_m3_k
    c_mushy = c + metal.density_kg_m3 * metal.latent_heat_j_kg / mushy
    above = math.log((filling.initial_k[1] - mould_k) / (metal.liquidus_k - mould_k))
    through = math.log((metal.liquidus_k - mould_k) / (metal.solidus_k - mould_k))
    return filling.resistance_m2k_w * volume_over_area_m * (c * above + c_mushy * through)
