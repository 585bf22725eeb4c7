"""Collisions of particles that come too near: what keeps metal that falls from passing into others.

A particle that falls is a surface, without pressure, until it has come far into the metal it meets;
then the density asks for a jump. So particles nearer than a share of their size that still approach
collide as rigid balls do, with little restitution (Lee, Park, Kim and Hwang 2011).
"""

from __future__ import annotations

import numpy as np

from sandmould.casting.mps.neighbours import Neighbours
from sandmould.casting.mps.operators import approach
from sandmould.casting.mps.particles import FLUID, Floats, Kinds
from sandmould.casting.mps.weight import OPTIONS
from sandmould.compiled import njit


@njit(**OPTIONS)
def collisions(
    near: Neighbours, velocity: Floats, kind: Kinds, distance_m: float, restitution: float
) -> Floats:
    """Change of velocity in the collisions of one instant, (n, 3) float64, m/s.

    All of a particle's collisions start from the same velocities; those of two particles of fluid
    cancel, so that momentum is kept.

    0 on walls and dummies.

    Parameters
    ----------
    velocity : (n, 3) float64, m/s
    kind : (n,) int8
        The mould does not give way.
    distance_m : float, m
        Nearer than which particles collide.
    restitution : float
        Speed of parting over that of approach.
    """
    change = np.zeros_like(velocity)
    for i in range(len(kind)):
        if kind[i] == FLUID:
            for k in range(near.start[i], near.start[i + 1]):
                away = near.away_m[k]
                r2 = away[0] ** 2 + away[1] ** 2 + away[2] ** 2
                closing = -approach(near, velocity, k, i)
                if r2 < distance_m**2 and closing > 0.0:
                    share = 0.5 if kind[near.other[k]] == FLUID else 1.0
                    change[i] -= (1.0 + restitution) * share * closing / r2 * away
    return change
