"""Grains in flight: gravity, central differences (3)-(7), background damping (34)-(39)."""

from __future__ import annotations

import math
from collections.abc import Iterator

import numpy as np

from tests.verification.cases.bench import Bench, along_of, scene, spin, spin_of, vector
from tests.verification.cases.case import Measured, case

GRAVITY = 9.80665


@case("(3)-(5)", "1e-11: round-off of 5 000 steps; central differences are exact for a parabola")
def projectile(engine: str, dimension: int) -> Iterator[Measured]:
    """A thrown grain: x = x_0 + v_0 t, z = z_0 + w_0 t - g t^2/2."""
    speed, climb, start = 0.6, 0.7, 0.02
    given = scene(engine, dimension, step_s=2e-5, gravity_m_s2=GRAVITY)
    with Bench(given) as bench:
        bench.place([vector(dimension, start, start)], [vector(dimension, speed, climb)])
        found = bench.advance(0.1)
    t = found.time_s
    way = start + speed * t
    yield Measured("way", along_of(found.position_m)[0], way, 1e-11 * way, "m")
    height = start + climb * t - GRAVITY * t**2 / 2
    yield Measured("height", found.position_m[0, -1], height, 1e-11 * way, "m")
    fall = climb - GRAVITY * t
    yield Measured("vertical speed", found.velocity_m_s[0, -1], fall, 1e-11, "m/s")


@case(
    "(36)",
    "2e-5: a step of central differences multiplies by 1 - alpha dt, off by alpha^2 t dt/2 = 8e-6",
)
def viscous_damping_of_speed(engine: str, dimension: int) -> Iterator[Measured]:
    """Without gravity v' = -alpha v: v = v_0 exp(-alpha t), whatever the direction."""
    rate, speed = 20.0, 0.5
    damping = {"form": "viscous", "viscous_translation_per_s": rate}
    given = scene(engine, dimension, step_s=2e-6, background_damping=damping)
    with Bench(given) as bench:
        bench.place([vector(dimension, 0.05, 0.05)], [vector(dimension, speed, 0.5 * speed)])
        found = bench.advance(0.02)
    share = math.exp(-rate * found.time_s)
    tolerance = 2e-5 * share
    along = along_of(found.velocity_m_s)[0] / speed
    yield Measured("v/v_0 along", along, share, tolerance)
    yield Measured("v/v_0 up", found.velocity_m_s[0, -1] / (0.5 * speed), share, tolerance)


@case("(37)", "2e-5: alpha^2 t dt/2, as for the speed")
def viscous_damping_of_spin(engine: str, dimension: int) -> Iterator[Measured]:
    """The same for the spin: w = w_0 exp(-alpha t)."""
    rate, turn = 20.0, 3.0
    damping = {"form": "viscous", "viscous_rotation_per_s": rate}
    given = scene(engine, dimension, step_s=2e-6, background_damping=damping)
    with Bench(given) as bench:
        place = [vector(dimension, 0.05, 0.05)]
        bench.place(place, None, [spin(dimension, turn)])
        found = bench.advance(0.02)
    share = math.exp(-rate * found.time_s)
    yield Measured("w/w_0", spin_of(dimension, found.spin_rad_s)[0] / turn, share, 2e-5 * share)


@case(
    "(38)",
    "2 g dt: the step in which the speed changes its sign is damped one way only",
    form=["nonviscous_isotropic", "nonviscous_componentwise"],
)
def nonviscous_damping_of_a_jump(engine: str, dimension: int, form: str) -> Iterator[Measured]:
    """Thrown straight up, a grain is slowed by g (1 + alpha) and then falls with g (1 - alpha)."""
    share, climb, start = 0.1, 0.5, 0.02
    damping = {"form": form, "nonviscous_translation": share, "nonviscous_rotation": 0.0}
    given = scene(engine, dimension, step_s=2e-6, background_damping=damping, gravity_m_s2=GRAVITY)
    turns = climb / (GRAVITY * (1 + share))
    with Bench(given) as bench:
        bench.place([vector(dimension, 0.05, start)], [vector(dimension, 0.0, climb)])
        rises, falls = bench.advance(0.9 * turns), bench.advance(0.9 * turns)
    slack = 2 * GRAVITY * given.step_s
    for what, state, exact in (
        ("rising", rises, climb - (1 + share) * GRAVITY * rises.time_s),
        ("falling", falls, -(1 - share) * GRAVITY * (falls.time_s - turns)),
    ):
        speed = state.velocity_m_s[0, -1]
        yield Measured(f"speed, {what}, {form.removeprefix('nonviscous_')}", speed, exact, slack,
                       "m/s")  # fmt: skip


@case(
    "(38)",
    "1e-5: the damping sees the velocity half a step late, g dt/v = 4e-5 of its direction",
    form=["nonviscous_isotropic", "nonviscous_componentwise"],
)
def nonviscous_damping_of_a_throw(engine: str, dimension: int, form: str) -> Iterator[Measured]:
    """Thrown obliquely, isotropic damping bends the path, that by components leaves v_x alone.

    The speed is s, and phi the angle above the horizon.

    Isotropic: s' = -g (sin(phi) + alpha) along the path, s phi' = -g cos(phi) across it. So
    ds/s = (tan(phi) + alpha/cos(phi)) dphi. From this follows
    v_x = s cos(phi) = C (1/cos(phi) + tan(phi))^alpha.

    By components: the force has no horizontal part, so v_x = v_x0.
    """
    share, speed, climb = 0.2, 0.4, 0.4
    damping = {"form": form, "nonviscous_translation": share, "nonviscous_rotation": 0.0}
    given = scene(engine, dimension, step_s=2e-6, background_damping=damping, gravity_m_s2=GRAVITY)
    with Bench(given) as bench:
        bench.place([vector(dimension, 0.02, 0.05)], [vector(dimension, speed, climb)])
        found = bench.advance(0.07)
    along, up = along_of(found.velocity_m_s)[0], found.velocity_m_s[0, -1]
    exact = speed
    if form == "nonviscous_isotropic":

        def bent(v_x: float, v_z: float) -> float:
            return float((math.hypot(v_x, v_z) / v_x + v_z / v_x) ** share)

        exact = speed * bent(along, up) / bent(speed, climb)
    yield Measured(f"v_x, {form.removeprefix('nonviscous_')}", along, exact, 1e-5 * speed, "m/s")


@case("(34), (35)", "0: nothing acts, so nothing is damped", engines=("lammps", "reference"))
def nonviscous_damping_of_a_free_grain(engine: str, dimension: int) -> Iterator[Measured]:
    """Without force and moment the damping (38), (39) is none: speed and spin stay."""
    damping = {
        "form": "nonviscous_isotropic", "nonviscous_translation": 0.5, "nonviscous_rotation": 0.5,
    }  # fmt: skip
    given = scene(engine, dimension, step_s=1e-5, background_damping=damping)
    with Bench(given) as bench:
        speed, turn = vector(dimension, 0.3, 0.1), spin(dimension, 2.0)
        bench.place([vector(dimension, 0.05, 0.05)], [speed], [turn])
        found = bench.advance(0.01)
    change = np.abs(found.velocity_m_s[0] - speed).max() + np.abs(found.spin_rad_s[0] - turn).max()
    yield Measured("change of speed and spin", float(change), 0.0, 0.0, "m/s, rad/s")
