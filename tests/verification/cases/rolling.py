"""Rolling resistance between two grains of different size, eqs. (29)-(33)."""

from __future__ import annotations

import math
from collections.abc import Iterator

import numpy as np

from tests.verification.cases.bench import (
    LARGE_M,
    LIGHT_M_S2,
    SMALL_M,
    Bench,
    crossing,
    inertia_factor,
    law,
    mass_kg,
    scene,
    spin,
    spin_of,
    stiffness,
    vector,
)
from tests.verification.cases.case import Measured, case


@case("(29), (31)-(33)", "1e-6: round-off, and the lower grain sinks by 1e-5 of its radius")
def moment_of_the_smaller_radius(engine: str, dimension: int) -> Iterator[Measured]:
    """A small grain spins on a large one at rest, and a large one on a small one, without friction.

    The upper grain presses with its weight. The moment on both is M = r_min tan(alpha) m g, with
    the smaller radius either way. It is read from the upper grain's spin, I w' = -M, and from the
    lower's, I w' = M.
    """
    arm, turn = 0.1, 2.0
    given = scene(
        engine,
        dimension,
        4,
        (SMALL_M, LARGE_M),
        law(dimension, 0.5, 0.0, arm),
        law(dimension, 0.5),
        1e-5,
        gravity_m_s2=LIGHT_M_S2,
    )
    mass = {r: mass_kg(dimension, r) for r in (SMALL_M, LARGE_M)}
    unit = stiffness(dimension)
    sag_floor = (mass[SMALL_M] + mass[LARGE_M]) * LIGHT_M_S2 / unit
    with Bench(given) as bench:
        small, large = bench.by_size()
        stacks = ((small[0], SMALL_M, large[0], LARGE_M), (large[1], LARGE_M, small[1], SMALL_M))
        place, spins = np.zeros((4, dimension)), np.zeros((4, 3))
        for n, (upper, r_up, lower, r_low) in enumerate(stacks):
            sag = mass[r_up] * LIGHT_M_S2 / unit
            height = r_low - sag_floor
            place[lower] = vector(dimension, 0.05 + 0.05 * n, height)
            place[upper] = vector(dimension, 0.05 + 0.05 * n, height + r_low + r_up - sag)
            spins[upper] = spin(dimension, turn)
        bench.place(place, None, spins)
        early, late = bench.advance(0.005), bench.advance(0.02)
        rate = spin_of(dimension, late.spin_rad_s - early.spin_rad_s)
        rate = rate / (late.time_s - early.time_s)
    kappa = inertia_factor(engine, dimension)
    for (upper, r_up, lower, r_low), what in zip(
        stacks, ("small on large", "large on small"), strict=True
    ):
        weight = mass[r_up] * LIGHT_M_S2
        for i, r, sign, whose in ((upper, r_up, -1.0, "upper"), (lower, r_low, 1.0, "lower")):
            moment = sign * kappa * mass[r] * r**2 * rate[i]
            yield Measured(
                f"f/r_min from the {whose} grain, {what}",
                moment / (weight * SMALL_M),
                arm,
                1e-6,
            )


@case(
    "(29), regularised",
    "1e-5: the sag over the radius; (omega dt)^2/24 is less",
    where=["floor", "pair"],
)
def swing_of_the_rolling_spring(engine: str, dimension: int, where: str) -> Iterator[Measured]:
    """Below its limit the rolling moment is a spring, k_roll r_eff^2 times the angle rolled.

    On the floor r_eff = r: omega^2 = k_roll/(kappa m). A small grain that lies on a large one has
    r_eff = r1 r2/(r1 + r2). The difference of the two spins swings with
    omega^2 = k_roll r_eff^2 (1/I1 + 1/I2). Equal spins roll without a moment. The difference
    vanishes for the second time after 3/4 of a period.
    """
    turn, soft, unit = 1e-3, 0.5, stiffness(dimension)
    kappa = inertia_factor(engine, dimension)
    light, heavy = mass_kg(dimension, SMALL_M), mass_kg(dimension, LARGE_M)
    rolls = law(dimension, 0.5, 0.0, 1.0, tangential=soft)
    smooth = law(dimension, 0.5)
    given = scene(
        engine,
        dimension,
        2,
        (SMALL_M, LARGE_M),
        rolls,
        rolls if where == "floor" else smooth,
        2e-6,
        gravity_m_s2=LIGHT_M_S2,
    )
    r_eff = SMALL_M * LARGE_M / (SMALL_M + LARGE_M)
    if where == "floor":
        exact = math.sqrt(soft * unit / (kappa * heavy))
    else:
        softness = 1 / (kappa * light * SMALL_M**2) + 1 / (kappa * heavy * LARGE_M**2)
        exact = math.sqrt(soft * unit * r_eff**2 * softness)
    carried = heavy if where == "floor" else heavy + light
    with Bench(given) as bench:
        (small,), (large,) = bench.by_size()
        place, spins = np.zeros((2, dimension)), np.zeros((2, 3))
        low = LARGE_M - carried * LIGHT_M_S2 / unit
        place[large] = vector(dimension, 0.05, low)
        spins[large] = spin(dimension, turn)
        if where == "floor":
            place[small] = vector(dimension, 0.15, 0.15)
        else:
            sag = light * LIGHT_M_S2 / unit
            place[small] = vector(dimension, 0.05, low + LARGE_M + SMALL_M - sag)
            spins[small] = spin(dimension, 3 * turn)
        bench.place(place, None, spins)
        bench.advance(0.98 * 1.5 * math.pi / exact)
        states = [bench.advance(0.001 * 1.5 * math.pi / exact) for _ in range(40)]
    w = np.array([spin_of(dimension, s.spin_rad_s) for s in states])
    differs = w[:, large] - (w[:, small] if where == "pair" else 0.0)
    found = 1.5 * math.pi / crossing(np.array([s.time_s for s in states]), differs)
    yield Measured(f"omega of the rolling spring, {where}", found, exact, 1e-5 * exact, "rad/s")
