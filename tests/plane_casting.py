"""A plane casting between two moulds: finite volumes of its own along one axis.

It shares no code with the solver. Conductivities are taken at the mean temperature of two cells,
enthalpies are sums over small steps of temperature.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from itertools import pairwise

import numpy as np

from sandmould.arrays import Flags, Floats

Property = Callable[[Floats], Floats]


@dataclass(frozen=True)
class Layer:
    """A slab of one material."""

    width_m: float
    start_k: float
    conductivity: Property
    capacity: Property
    """J/m3/K over K."""
    latent_j_m3: float = 0.0
    solid: Property | None = None
    """Solid fraction over temperature; where it jumps the heat of the jump goes at once."""


def constant(value: float) -> Property:
    """A property that is always the same."""
    return lambda temperature_k: np.full_like(temperature_k, value)


def plane_frozen_s(
    layers: Sequence[Layer],
    cell_m: float,
    transfer: Callable[[int, Floats, float], float],
    solidus_k: float,
    until_s: float,
) -> tuple[Floats, Floats, Floats]:
    """When each cell of what freezes was last seen to freeze.

    Parameters
    ----------
    layers : sequence of Layer
        Side by side; no heat leaves the outer ones.
    cell_m : float, m
    transfer : callable
        Resistance (m2 K/W) between layers k and k + 1 at the temperatures of both sides' surfaces
        and a time.
    solidus_k : float, K
    until_s : float, s

    Returns
    -------
    place_m, frozen_s, first_s : (cells,) float64
        Of the cells that freeze; NaN for what is liquid at the end. Last comes when each froze
        for the first time.
    """
    count = [round(layer.width_m / cell_m) for layer in layers]
    of = np.repeat(np.arange(len(layers)), count)
    grid = np.arange(200.0, 2200.0, 0.05)
    heats, least = [], []
    for layer in layers:
        capacity = layer.capacity(grid)
        heat = np.concatenate([[0.0], np.cumsum(0.05 * 0.5 * (capacity[1:] + capacity[:-1]))])
        if layer.solid is not None:
            heat += layer.latent_j_m3 * (1.0 - layer.solid(grid))
        heats.append(heat)
        least.append(float((layer.conductivity(grid) / capacity).max()))
    now = np.concatenate([np.full(n, la.start_k) for n, la in zip(count, layers, strict=True)])
    heat = np.concatenate(
        [np.interp(np.full(n, la.start_k), grid, h)
         for n, la, h in zip(count, layers, heats, strict=True)])  # fmt: skip
    melts = np.array([la.solid is not None for la in layers])[of]
    solid_heat = np.array([np.interp(solidus_k - 0.05, grid, h) for h in heats])[of]
    time_s = 0.0
    borders = np.flatnonzero(of[1:] != of[:-1])
    frozen, first = np.full(len(of), np.nan), np.full(len(of), np.nan)
    edges = np.concatenate([[0], np.cumsum(count)])
    parts = [slice(a, b) for a, b in pairwise(edges)]
    step_s, path = 0.45 * cell_m**2 / max(least), np.empty(len(of) - 1)
    while time_s < until_s:
        middle = 0.5 * (now[1:] + now[:-1])
        for own, layer in zip(parts, layers, strict=True):
            path[own] = cell_m / layer.conductivity(middle[own])
        for number, at in enumerate(borders):
            left, right = layers[of[at]], layers[of[at + 1]]
            half = [0.5 * cell_m / float(la.conductivity(now[k : k + 1])[0])
                    for la, k in ((left, at), (right, at + 1))]  # fmt: skip
            surface = np.array([now[at], now[at + 1]])
            for _ in range(3):
                through = sum(half) + transfer(number, surface, time_s)
                flux = (now[at] - now[at + 1]) / through
                surface = np.array([now[at] - flux * half[0], now[at + 1] + flux * half[1]])
            path[at] = through
        flux = (now[1:] - now[:-1]) / path
        before = heat.copy()
        heat[:-1] += step_s / cell_m * flux
        heat[1:] -= step_s / cell_m * flux
        for own, of_heat in zip(parts, heats, strict=True):
            now[own] = np.interp(heat[own], of_heat, grid)
        time_s += step_s
        passed: Flags = melts & (before >= solid_heat) & (heat < solid_heat)
        frozen[passed] = time_s
        first[passed & np.isnan(first)] = time_s
        frozen[melts & (heat >= solid_heat)] = np.nan
    place = np.concatenate([(np.arange(n) + 0.5) * cell_m for n in count])
    return place[melts], frozen[melts], first[melts]
