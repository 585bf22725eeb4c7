"""What collisions must keep: energy, momentum, angular momentum."""

from __future__ import annotations

import math
from collections.abc import Iterator

import numpy as np

from sandmould.engines.guard import grain_masses_kg
from tests.verification.cases.bench import (
    LARGE_M,
    RADIUS_M,
    SMALL_M,
    Array,
    Bench,
    inertia_factor,
    law,
    mass_kg,
    scene,
    stiffness,
    vector,
)
from tests.verification.cases.case import Measured, case

SPEED_M_S = 0.08


def _collision(
    engine: str, dimension: int, pair: dict[str, float]
) -> tuple[list[dict[str, Array]], Array]:
    """Six grains of two sizes meet in the middle and part again.

    Returns
    -------
    balances : list of dict
        Momentum, angular momentum and energy before, while they touch, and after.
    scale : (2,) float64
        Sums of the sizes of all momenta and of all angular momenta.
    """
    given = scene(engine, dimension, 6, (SMALL_M, LARGE_M), pair, step_s=2e-6)
    rng = np.random.default_rng(7)
    middle = np.full(dimension, 0.08)
    with Bench(given) as bench:
        state = bench.state()
        r, mass = state.radius_m, grain_masses_kg(given, state)
        angle = np.arange(6) * math.pi / 3 + 0.1
        rays = np.zeros((6, dimension))
        rays[:, 0], rays[:, -1] = np.cos(angle), np.sin(angle)
        if dimension == 3:
            rays[:, 1] = rng.uniform(-0.4, 0.4, 6)
            rays /= np.linalg.norm(rays, axis=1)[:, None]
        # Just not touching each other, with unequal speeds inwards and some sideways.
        place = middle + rays * 2.2 * LARGE_M
        velocity = -rays * SPEED_M_S * (1 + 0.3 * rng.random((6, 1)))
        velocity += 0.2 * SPEED_M_S * rng.normal(size=velocity.shape)
        spins = np.zeros((6, 3))
        spins[:, 2 if dimension == 2 else slice(None)] = rng.normal(
            0, SPEED_M_S / RADIUS_M, 6 if dimension == 2 else (6, 3)
        )
        bench.place(place, velocity, spins)
        inertia = inertia_factor(engine, dimension) * mass * r**2

        def balance() -> dict[str, Array]:
            now = bench.state()
            x, v = np.zeros((6, 3)), np.zeros((6, 3))
            x[:, :dimension], v[:, :dimension] = now.position_m - middle, now.velocity_m_s
            apart = np.linalg.norm(x[:, None] - x[None], axis=2) - r[:, None] - r[None]
            np.fill_diagonal(apart, 1.0)
            press = mass[:, None] * v
            return {
                "momentum": press.sum(axis=0),
                "angular": np.cross(x, press).sum(axis=0) + inertia @ now.spin_rad_s,
                "energy": 0.5 * (
                    mass @ (v**2).sum(axis=1) + inertia @ (now.spin_rad_s**2).sum(axis=1)
                ),
                "touching": np.array((apart < 0).sum() // 2),
                "sizes": np.array([
                    np.linalg.norm(press, axis=1).sum(),
                    (np.linalg.norm(press, axis=1) * np.linalg.norm(x, axis=1)).sum(),
                ]),
            }  # fmt: skip

        found = [balance()]
        met = 0
        for _ in range(25):
            bench.advance(0.002)
            found.append(balance())
            met = max(met, int(found[-1]["touching"]))
    assert met > 0, "no collision was seen"
    return found, found[0]["sizes"]


@case(
    "(14)-(17)", "1e-5: contacts begin and end between steps, (omega dt)^2 = 4e-5 of their energy"
)
def energy_of_smooth_collisions(engine: str, dimension: int) -> Iterator[Measured]:
    """Undamped smooth grains keep their kinetic energy once they have parted."""
    found, _ = _collision(engine, dimension, law(dimension))
    before, after = found[0]["energy"], found[-1]["energy"]
    assert not found[-1]["touching"]
    yield Measured("energy after over before", float(after / before), 1.0, 1e-5)


@case(
    "(14), (22)-(33)", "1e-12: round-off; 2e-10 for angular momentum, from the normals' last digits"
)
def momenta_of_rough_collisions(engine: str, dimension: int) -> Iterator[Measured]:
    """Damped rough grains with rolling resistance keep momentum, and angular momentum with spin.

    Central differences keep both to round-off if the two moments of a friction force add up to the
    force times the distance of the centres. So the arms must add up to r1 + r2 - u. They do on
    every engine, though LAMMPS takes the whole radii for the slip (23).
    """
    pair = law(dimension, 0.3, 0.5, 0.1)
    found, (linear, angular) = _collision(engine, dimension, pair)
    lost = max(np.abs(b["momentum"] - found[0]["momentum"]).max() for b in found) / linear
    yield Measured("change of momentum", float(lost), 0.0, 1e-12)
    turned = np.abs(found[-1]["angular"] - found[0]["angular"]).max() / angular
    yield Measured("change of angular momentum", float(turned), 0.0, 2e-10)


@case(
    "(3)-(5), (16)",
    "5e-5: the energy kept is a shadow, (omega dt)^2/8 of the spring's off; depth 1e-4",
)
def bounces_of_a_grain(engine: str, dimension: int) -> Iterator[Measured]:
    """An undamped grain bounces under gravity: m v^2/2 + m g z + k u^2/2 stays.

    Dropped by h it sinks in by u with k u^2/2 = m g (h + u).
    """
    gravity, drop = 9.80665, 1e-3
    given = scene(engine, dimension, step_s=2e-6, gravity_m_s2=gravity)
    mass, k = mass_kg(dimension), stiffness(dimension)
    weight = mass * gravity
    deepest = (weight + math.sqrt(weight**2 + 2 * k * weight * drop)) / k
    worst, lowest = 0.0, 0.0
    with Bench(given) as bench:
        bench.place([vector(dimension, 0.05, RADIUS_M + drop)])
        hits = math.sqrt(2 * drop / gravity)
        bench.advance(hits)
        for sample in range(150):
            # The first contact closely, then some bounces from afar.
            now = bench.advance(2e-5 if sample < 100 else 2e-3)
            u = max(0.0, RADIUS_M - now.position_m[0, -1])
            energy = 0.5 * mass * (now.velocity_m_s[0] ** 2).sum() + 0.5 * k * u**2
            energy += weight * (now.position_m[0, -1] - RADIUS_M - drop)
            worst, lowest = max(worst, abs(energy) / (weight * drop)), max(lowest, u)
    yield Measured("energy lost or gained, over m g h", worst, 0.0, 5e-5)
    yield Measured("deepest overlap", lowest, deepest, 1e-4 * deepest, "m")
