"""Exact solutions of conduction and of freezing in one dimension."""

from __future__ import annotations

import math

import numpy as np
from scipy.optimize import brentq
from scipy.special import erf, erfcx

from sandmould.arrays import Floats
from sandmould.casting.arpm.material import ThermalMaterial


def contact_temperature_k(
    place_m: Floats,
    time_s: float,
    bodies: tuple[ThermalMaterial, ThermalMaterial],
    initial_k: tuple[float, float],
    resistance_m2k_w: float = 0.0,
) -> Floats:
    """Two half spaces that touch from time 0 on, with a resistance between them.

    Carslaw and Jaeger, Conduction of Heat in Solids, 2nd edition, section 2.16.

    Parameters
    ----------
    place_m : (n,) float64, m
        Negative in the first body, positive in the second.
    time_s : float, s
        Above 0.
    bodies : two Material
    initial_k : two float, K
    resistance_m2k_w : float, m2 K/W

    Returns
    -------
    (n,) float64, K
    """
    effusivity = [math.sqrt(b.conductivity_w_m_k * b.capacity_j_m3_k) for b in bodies]
    contact = sum(e * t for e, t in zip(effusivity, initial_k, strict=True)) / sum(effusivity)
    temperature_k = np.empty(len(place_m))
    for number, body in enumerate(bodies):
        own = (place_m < 0.0) if number == 0 else (place_m >= 0.0)
        depth = np.abs(place_m[own])
        diffusivity = body.conductivity_w_m_k / body.capacity_j_m3_k
        similar = depth / (2.0 * math.sqrt(diffusivity * time_s))
        share = erf(similar)
        if resistance_m2k_w > 0.0:
            h = sum(effusivity) / (resistance_m2k_w * effusivity[1 - number])
            late = h * math.sqrt(diffusivity * time_s) / body.conductivity_w_m_k
            # exp(a) erfc(b) with a - b^2 = -similar^2, in a form that does not overflow
            share = share + np.exp(-(similar**2)) * erfcx(similar + late)
        temperature_k[own] = contact + (initial_k[number] - contact) * share
    return temperature_k


def stefan_front(body: ThermalMaterial, melting_k: float, wall_k: float) -> float:
    """Speed lambda of the one-phase Stefan problem: the front is at 2 lambda sqrt(a t).

    A liquid at its melting point freezes at a wall: lambda exp(lambda^2) erf(lambda) =
    c (T_m - T_w) / (L sqrt(pi)) (Carslaw and Jaeger, section 11.2, Neumann's solution).

    Parameters
    ----------
    body : ThermalMaterial
    melting_k, wall_k : float, K
    """
    number = body.heat_capacity_j_kg_k * (melting_k - wall_k) / body.latent_heat_j_kg
    target = number / math.sqrt(math.pi)
    return float(brentq(lambda x: x * math.exp(x * x) * math.erf(x) - target, 1e-9, 5.0))


def stefan_temperature_k(place_m: Floats, time_s: float, body: ThermalMaterial, melting_k: float,
                         wall_k: float) -> Floats:  # fmt: skip
    """Temperature of the one-phase Stefan problem at distances from the wall, (n,) float64, K.

    Parameters
    ----------
    place_m : (n,) float64, m
    time_s : float, s
    body : ThermalMaterial
    melting_k, wall_k : float, K
    """
    front = stefan_front(body, melting_k, wall_k)
    diffusivity = body.conductivity_w_m_k / body.capacity_j_m3_k
    similar = place_m / (2.0 * math.sqrt(diffusivity * time_s))
    frozen = wall_k + (melting_k - wall_k) * erf(similar) / math.erf(front)
    return np.asarray(np.where(similar < front, frozen, melting_k))
