"""Order of convergence in the time step."""

from __future__ import annotations

import math
from collections.abc import Iterator

import numpy as np

from tests.verification.cases import closed_forms
from tests.verification.cases.bench import (
    LARGE_M,
    SMALL_M,
    Bench,
    along_of,
    inertia_factor,
    law,
    mass_kg,
    scene,
    stiffness,
    vector,
)
from tests.verification.cases.case import Measured, case

STEPS = (25, 50, 100, 200, 400)
"""Steps of a contact."""


@case(
    "(3)-(7), (19)-(28)",
    "0.15: the coarsest steps show the next order, and slip ends between steps",
)
def order_in_the_step(engine: str, dimension: int) -> Iterator[Measured]:
    """Errors of two impacts over the step, which is a whole part of either contact's duration.

    A damped impact on the floor is of first order: the plain dashpot (19) takes the velocity half a
    step late. An undamped oblique impact of two grains is of second order. Differences are central,
    and the friction (25) adds up displacements of whole steps. Its grip (omega_t = 1.5 omega) lasts
    until the friction's limit vanishes with the normal force.
    """
    z, speed, mu = 0.5, 1e-5, 10.0
    small, large = mass_kg(dimension, SMALL_M), mass_kg(dimension, LARGE_M)
    lasts = closed_forms.contact_time_s(math.sqrt(stiffness(dimension) / large), z, "total")
    effective = small * large / (small + large)
    normal = effective * (math.pi / lasts) ** 2 / stiffness(dimension)
    kappa = inertia_factor(engine, dimension)
    grip = 2.25 / (1 + 1 / kappa)
    pair = law(dimension, 0.0, mu, normal=normal, tangential=grip * normal)
    exact = {
        "floor": closed_forms.restitution(z, "total"),
        "pair": closed_forms.Oblique(math.pi / lasts, grip, mu, kappa).impulse(1.0, 1.0),
    }
    errors: dict[str, list[float]] = {"floor": [], "pair": []}
    for steps in STEPS:
        given = scene(
            engine, dimension, 4, (SMALL_M, LARGE_M), pair, law(dimension, z), lasts / steps,
            contact={"dashpot": "plain"},
        )  # fmt: skip
        with Bench(given) as bench:
            (hits, idle), (falls, is_hit) = bench.by_size()
            place, velocity = np.zeros((4, dimension)), np.zeros((4, dimension))
            place[falls] = vector(dimension, 0.03, LARGE_M)
            place[idle] = vector(dimension, 0.15, 0.15)
            place[is_hit] = vector(dimension, 0.06, 0.06)
            place[hits] = vector(dimension, 0.06, 0.06 + SMALL_M + LARGE_M)
            velocity[falls] = vector(dimension, 0.0, -speed)
            velocity[hits] = vector(dimension, speed, -speed)
            bench.place(place, velocity)
            after = bench.advance(1.2 * lasts).velocity_m_s
        impulse = (speed - along_of(after)[hits]) / speed * small / effective
        errors["floor"].append(after[falls, -1] / speed - exact["floor"])
        errors["pair"].append(impulse - exact["pair"])
    for key, what, order in (
        ("floor", "damped impact", 1.0),
        ("pair", "gripping impact", 2.0),
    ):
        slope = -np.polyfit(np.log(STEPS), np.log(np.abs(errors[key])), 1)[0]
        yield Measured(f"order, {what}", float(slope), order, 0.15)
