"""Oblique impacts: Coulomb's law with radial return, eqs. (22)-(28)."""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import dataclass

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
    spin,
    spin_of,
    stiffness,
    vector,
)
from tests.verification.cases.case import Measured, case

SPEED_M_S = 1e-7
"""Normal speed of an impact: so slow that overlaps and turns of the normal are below 1e-6."""


@dataclass(frozen=True)
class Rebound:
    """What one impact did, by impulses over the mass of (21), m/s, and by the turn it gave."""

    where: str
    omega_rad_s: float
    normal: float
    tangential: float
    turn: float
    """Radius times the change of spin times kappa over the tangential speed change."""


def impacts(
    engine: str,
    dimension: int,
    contact_law: dict[str, float],
    normal_m_s: float,
    slip_m_s: float,
    step_s: float = 1e-6,
) -> Iterator[Rebound]:
    """One large grain on the floor and a small one on a large one from above."""
    given = scene(engine, dimension, 4, (SMALL_M, LARGE_M), contact_law, contact_law, step_s)
    small, large = mass_kg(dimension, SMALL_M), mass_kg(dimension, LARGE_M)
    k_n = contact_law["normal_stiffness_n_m"]
    gap = 1e-3 * normal_m_s / math.sqrt(k_n / small)
    with Bench(given) as bench:
        (hits, idle), (falls, is_hit) = bench.by_size()
        place, velocity = np.zeros((4, dimension)), np.zeros((4, dimension))
        place[falls] = vector(dimension, 0.03, LARGE_M + gap)
        place[idle] = vector(dimension, 0.15, 0.15)
        place[is_hit] = vector(dimension, 0.06, 0.06)
        place[hits] = vector(dimension, 0.06, 0.06 + SMALL_M + LARGE_M + gap)
        velocity[[falls, hits]] = vector(dimension, slip_m_s, -normal_m_s)
        spins = np.zeros((4, 3))
        # Half of the slip of the floor's grain is spin.
        velocity[falls] = vector(dimension, 0.5 * slip_m_s, -normal_m_s)
        spins[falls] = spin(dimension, 0.5 * slip_m_s / LARGE_M)
        bench.place(place, velocity, spins)
        before = bench.state()
        slowest = math.sqrt(k_n / large)
        after = bench.advance(1.1 * math.pi / slowest)
        kappa = inertia_factor(engine, dimension)
        gain = after.velocity_m_s - before.velocity_m_s
        turned = spin_of(dimension, after.spin_rad_s - before.spin_rad_s)
        effective = small * large / (small + large)
        for where, i, r, mass, acting in (
            ("grain on floor", falls, LARGE_M, large, large),
            ("small on large grain", hits, SMALL_M, small, effective),
        ):
            tangential = -along_of(gain)[i]
            turn = -turned[i] * r * kappa / tangential if tangential else math.nan
            yield Rebound(
                where,
                math.sqrt(k_n / acting),
                gain[i, -1] * mass / acting,
                tangential * mass / acting,
                turn,
            )


@case(
    "(22)-(26), (28)",
    "1e-5: the line of centres turns by 1e-6 meanwhile; angle: (omega dt)^2/24 of J_n",
    damping_ratio=[0.0, 0.5],
)
def sliding_impact(engine: str, dimension: int, damping_ratio: float) -> Iterator[Measured]:
    """A fast oblique impact slides throughout: the tangential impulse is mu times the normal one.

    It holds whatever the normal law is, for the total normal force caps the friction. The moment
    r J_t turns the grain: r dw kappa = J_t/m. Undamped, the normal speed is reversed,
    J_n = 2 m v_n, and the speed along the floor falls by 2 mu v_n, which gives the angle.
    """
    mu, slip = 0.1, 20 * SPEED_M_S
    contact_law = law(dimension, damping_ratio, mu)
    for found in impacts(engine, dimension, contact_law, SPEED_M_S, slip, 1e-5):
        label = f"zeta = {damping_ratio:g}, {found.where}"
        ratio = found.tangential / found.normal
        yield Measured(f"tangential over normal impulse, {label}", ratio, mu, 1e-5)
        yield Measured(f"moment over r times impulse, {label}", found.turn, 1.0, 1e-5)
        if damping_ratio == 0.0:
            angle = math.degrees(math.atan((slip - found.tangential) / SPEED_M_S))
            exact = math.degrees(math.atan(slip / SPEED_M_S - 2 * mu))
            yield Measured(f"angle of rebound, {label}", angle, exact, 2e-4, "deg")


@case(
    "(24)-(28)",
    "2e-6: (omega dt)^2/8 at a step of 3e-3/omega",
    regime=["sticking", "mixed"],
)
def gripping_impact(engine: str, dimension: int, regime: str) -> Iterator[Measured]:
    """A slow oblique impact grips, against the linear spring model.

    While it sticks, the tangential spring swings with omega_t^2 = (1 + 1/kappa) k_t/m beside the
    normal one with omega^2 = k_n/m.

    Sticking: omega_t = omega. The ratio of the two forces stays the same, so the contact never
    slips, and the spring has swung back when the contact ends. The slip is reversed,
    J_t = 2 m v_s/(1 + 1/kappa).

    Mixed: k_t = k_n and mu = 0.5. Stick and slip follow each other. The exact value is integrated
    piece by piece with their events (solve_ivp, 1e-11).
    """
    kappa = inertia_factor(engine, dimension)
    tangential = 1 / (1 + 1 / kappa) if regime == "sticking" else 1.0
    mu, slip = (2.0, SPEED_M_S) if regime == "sticking" else (0.5, 1.3 * SPEED_M_S)
    contact_law = law(dimension, 0.0, mu, tangential=tangential)
    for found in impacts(engine, dimension, contact_law, SPEED_M_S, slip):
        if regime == "sticking":
            exact = 2 * slip / (1 + 1 / kappa)
        else:
            model = closed_forms.Oblique(found.omega_rad_s, tangential, mu, kappa)
            exact = model.impulse(SPEED_M_S, slip)
        share = found.tangential / slip
        yield Measured(f"J_t/(m v_s), {regime}, {found.where}", share, exact / slip, 2e-6)


@case(
    "(22), (23)",
    "1e-6, (omega dt)^2/8, on the reference engine; others may differ by what an arm of r makes",
)
def contact_point(engine: str, dimension: int) -> Iterator[Measured]:
    """Where on the overlap friction acts: the arm at a wall, shown by a deep sliding impact.

    The overlap u = u_m sin(omega t) has the mean u_m pi/4, weighted by the force. The paper does
    not say where on it the contact point is. Friction on the wall's surface, at the arm r - u, has
    the moment r J_t (1 - pi/4 u_m/r), which is the exact value here. LIGGGHTS has the arm r - u/2,
    as between grains: a moment of 1 - pi/8 u_m/r = 0.99215. LAMMPS has the arm r: a moment of 1.
    """
    mu = 0.1
    depth = 0.02 * LARGE_M
    speed = depth * math.sqrt(stiffness(dimension) / mass_kg(dimension, LARGE_M))
    contact_law = law(dimension, 0.0, mu)
    found = next(impacts(engine, dimension, contact_law, speed, 10 * speed))
    shortened = math.pi / 4 * depth / LARGE_M
    yield Measured(
        "moment over r times impulse, u_m = 0.02 r",
        found.turn,
        1 - shortened,
        1e-6 if engine == "reference" else 1.001 * shortened,
    )
