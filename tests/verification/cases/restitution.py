"""Head-on impacts: the normal law, eqs. (15)-(21), in both readings of (18)."""

from __future__ import annotations

import math
from collections.abc import Iterator

import numpy as np

from tests.verification.cases import closed_forms
from tests.verification.cases.bench import (
    LARGE_M,
    SMALL_M,
    Bench,
    law,
    mass_kg,
    scene,
    stiffness,
    vector,
)
from tests.verification.cases.case import Measured, case

SPEED_M_S = 0.01


@case(
    "(15)-(21)",
    "the dashpot sees the velocity half a step late: first order in the step, 0.2 omega dt",
    damping_ratio=[0.05, 0.2, 0.5, 0.7, 0.95, 1.0],
    no_tension=["total", "elastic"],
)
def restitution(
    engine: str, dimension: int, damping_ratio: float, no_tension: str
) -> Iterator[Measured]:
    """A large grain falls on the floor, a small one hits another large one, without gravity.

    The overlap follows u'' + 2 zeta omega u' + omega^2 u = 0 with omega^2 = k_n/m. The mass is that
    of (21), m1 m2/(m1 + m2), or at a wall that of the grain. The rebound is the speed at which the
    contact ends.

    Elastic part clipped: the contact ends with the overlap, e = exp(-pi zeta/sqrt(1 - zeta^2)).

    Total clipped: the contact ends where the total force first vanishes,
    e = exp(-zeta/sqrt(1 - zeta^2) atan2(2 zeta sqrt(1 - zeta^2), 2 zeta^2 - 1)). At zeta 1 this is
    exp(-2).
    """
    spring = law(dimension, damping_ratio)
    given = scene(
        engine, dimension, 4, (SMALL_M, LARGE_M), spring, spring,
        contact={"no_tension": no_tension},
    )  # fmt: skip
    small, large = mass_kg(dimension, SMALL_M), mass_kg(dimension, LARGE_M)
    omega = {
        "floor": math.sqrt(stiffness(dimension) / large),
        "pair": math.sqrt(stiffness(dimension) * (1 / small + 1 / large)),
    }
    gap = 1e-3 * SPEED_M_S / omega["pair"]
    with Bench(given) as bench:
        (hits, idle), (falls, is_hit) = bench.by_size()
        place, velocity = np.zeros((4, dimension)), np.zeros((4, dimension))
        place[falls] = vector(dimension, 0.02, LARGE_M + gap)
        place[idle] = vector(dimension, 0.15, 0.15)
        place[is_hit] = vector(dimension, 0.06, 0.06)
        # An oblique line of centres, so that no axis is special.
        line = vector(dimension, 0.8, 0.6)
        place[hits] = place[is_hit] - line * (SMALL_M + LARGE_M + gap)
        velocity[falls] = vector(dimension, 0.0, -SPEED_M_S)
        velocity[hits] = line * SPEED_M_S
        bench.place(place, velocity)
        lasts = closed_forms.contact_time_s(omega["floor"], damping_ratio, no_tension)
        # A critically damped contact that may pull never ends: three periods are as good.
        after = bench.advance(1.05 * min(lasts, 6 * math.pi / omega["floor"])).velocity_m_s
    exact = closed_forms.restitution(damping_ratio, no_tension)
    rebound = {"floor": after[falls, -1], "pair": (after[is_hit] - after[hits]) @ line}
    where = {"floor": "grain on floor", "pair": "small on large grain"}
    for key, speed in rebound.items():
        yield Measured(
            f"zeta = {damping_ratio:g}, {no_tension} clipped, {where[key]}",
            speed / SPEED_M_S,
            exact,
            0.2 * omega[key] * given.step_s,
        )
