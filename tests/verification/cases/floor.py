"""Grains that slide, roll and spin on the floor under a light gravity: (25)-(33)."""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import dataclass
from typing import Any

import numpy as np

from sandmould.engines.snapshot import Snapshot
from tests.verification.cases.bench import (
    LIGHT_M_S2,
    OMEGA_RAD_S,
    RADIUS_M,
    Array,
    Bench,
    along_of,
    crossing,
    inertia_factor,
    law,
    scene,
    spin,
    spin_of,
    vector,
)
from tests.verification.cases.case import Measured, case

SAG_M = LIGHT_M_S2 / OMEGA_RAD_S**2
"""Overlap with the floor that carries a grain of RADIUS_M."""
FORMS = ["nonviscous_isotropic", "nonviscous_componentwise"]


def on_floor(dimension: int, grains: int) -> Array:
    """Places of grains at rest on the floor, far from each other."""
    return np.array([vector(dimension, 0.03 + 0.03 * i, RADIUS_M - SAG_M) for i in range(grains)])


def swing_rad_s(kappa: float) -> float:
    """Frequency of the tangential spring of a grain on the floor, omega sqrt(1 + 1/kappa)."""
    return OMEGA_RAD_S * math.sqrt(1 + 1 / kappa)


@dataclass(frozen=True)
class Track:
    """Rolling motion of one grain over time."""

    time_s: Array
    along_m: Array
    speed_m_s: Array
    spin_rad_s: Array

    @property
    def slip_m_s(self) -> Array:
        return self.speed_m_s + RADIUS_M * self.spin_rad_s


def follow(bench: Bench, until_s: float, samples: int) -> list[Track]:
    """Compute up to a time in equal parts; the motion of each grain."""
    start = bench.session.time_s
    states: list[Snapshot] = [bench.advance((until_s - start) / samples) for _ in range(samples)]
    d = bench.scenario.dimension
    return [
        Track(
            np.array([s.time_s for s in states]),
            np.array([along_of(s.position_m)[i] for s in states]),
            np.array([along_of(s.velocity_m_s)[i] for s in states]),
            np.array([spin_of(d, s.spin_rad_s)[i] for s in states]),
        )
        for i in range(len(states[0].id))
    ]


@case(
    "(22)-(28)",
    "1e-4: the sag, 1e-5 of the radius, shortens arms; the first steps stick",
)
def from_sliding_to_rolling(engine: str, dimension: int) -> Iterator[Measured]:
    """A grain is launched without spin, another with spin alone; friction makes both roll.

    Friction gives m v' = -mu m g and kappa m r^2 w' = -mu m g r. So the slip v + r w falls from v_0
    by mu g (1 + 1/kappa) a second, and v - kappa r w stays.

    Rolling begins at the speed v_0/(1 + kappa) of the launched grain: 2/3 of v_0 for a disc, 5/7
    for a sphere. For the spun grain it is kappa v_0/(1 + kappa).

    Before that, the spring is stretched to its limit in a time T, with
    sin(omega_t T) = mu g omega_t/(v_0 omega^2). The slip is then v_0 cos(omega_t T).
    """
    mu, speed = 0.35, 5e-3
    given = scene(
        engine, dimension, 2, wall=law(dimension, 0.5, mu), step_s=4e-6, gravity_m_s2=LIGHT_M_S2
    )
    with Bench(given) as bench:
        kappa = inertia_factor(engine, dimension)
        swing = swing_rad_s(kappa)
        slowing = mu * LIGHT_M_S2 * (1 + 1 / kappa)
        phase = math.asin(mu * LIGHT_M_S2 * swing / (speed * OMEGA_RAD_S**2))
        onset = phase / swing + speed * math.cos(phase) / slowing
        velocity = np.zeros((2, dimension))
        velocity[0] = vector(dimension, speed, 0.0)
        spins = np.zeros((2, 3))
        spins[1] = spin(dimension, speed / RADIUS_M)
        bench.place(on_floor(dimension, 2), velocity, spins)
        bench.advance(0.99 * onset)
        tracks = follow(bench, 1.01 * onset, 40)
    for track, what, exact in (
        (tracks[0], "launched", speed / (1 + kappa)),
        (tracks[1], "spun", -kappa * speed / (1 + kappa)),
    ):
        found = crossing(track.time_s, track.slip_m_s)
        yield Measured(f"onset of rolling, {what}", found, onset, 1e-4 * onset, "s")
        rolls = float(np.interp(found, track.time_s, track.speed_m_s))
        yield Measured(f"speed then, {what}", rolls, exact, 1e-4 * speed, "m/s")


@case(
    "(29), (30)",
    "1e-3: the tangential spring swings at first, 1/(omega_t t) of the way",
)
def rolling_to_a_stop(engine: str, dimension: int) -> Iterator[Measured]:
    """A rolling grain is stopped by the moment of its arm: (I + m r^2) w' = -r tan(alpha) m g.

    The energy m (1 + kappa) v_0^2/2 is spent on the moment. While the rolling spring is stretched
    over x_0 = tan(alpha) m g/k_roll, the moment is half of its limit on average. So the way is
    v_0^2 (1 + kappa)/(2 tan(alpha) g) + x_0/2.
    """
    arm, speed = 0.1, 3e-3
    given = scene(
        engine,
        dimension,
        wall=law(dimension, 0.5, 0.8, arm),
        step_s=3e-5,
        gravity_m_s2=LIGHT_M_S2,
    )
    with Bench(given) as bench:
        kappa = inertia_factor(engine, dimension)
        slowing = arm * LIGHT_M_S2 / (1 + kappa)
        start = on_floor(dimension, 1)
        bench.place(start, [vector(dimension, speed, 0.0)], [spin(dimension, -speed / RADIUS_M)])
        stops = speed / slowing
        bench.advance(0.98 * stops)
        (track,) = follow(bench, 1.01 * stops, 60)
    way = float(track.along_m.max()) - 0.03
    exact = speed**2 / (2 * slowing) + 0.5 * arm * SAG_M
    yield Measured("way to the stop", way, exact, 1e-3 * exact, "m")


def _slowing(engine: str, dimension: int, turn: Array, arm: float, **changes: Any) -> float:
    """Rate at which a grain loses the size of its spin on a smooth floor, rad/s2."""
    given = scene(
        engine,
        dimension,
        wall=law(dimension, 0.5, 0.0, arm),
        step_s=1e-5,
        gravity_m_s2=LIGHT_M_S2,
        **changes,
    )
    with Bench(given) as bench:
        bench.place(on_floor(dimension, 1), None, [turn])
        early, late = bench.advance(0.01), bench.advance(0.03)
        lost = np.linalg.norm(early.spin_rad_s) - np.linalg.norm(late.spin_rad_s)
        return float(lost / (late.time_s - early.time_s))


@case("(29), (30)", "1e-8: round-off; the moment is constant")
def spinning_on_the_spot(engine: str, dimension: int) -> Iterator[Measured]:
    """On a smooth floor the rolling moment alone slows a spin: w' = -tan(alpha) g/(kappa r)."""
    arm = 0.1
    found = _slowing(engine, dimension, spin(dimension, 1.0), arm)
    kappa = inertia_factor(engine, dimension)
    exact = arm * LIGHT_M_S2 / (kappa * RADIUS_M)
    yield Measured("slowing of a rolling spin", found, exact, 1e-8 * exact, "rad/s2")


@case("(31)", "1e-8: as above", dimensions=(3,), rolling_axes=["tangent", "all"])
def spinning_like_a_top(engine: str, dimension: int, rolling_axes: str) -> Iterator[Measured]:
    """A spin about the normal is slowed alike where (31) is read literally.

    It is not slowed at all where the rolling moment resists only the spins that roll.
    """
    arm = 0.1
    top = np.array([0.0, 0.0, 1.0])
    found = _slowing(engine, dimension, top, arm, contact={"rolling_axes": rolling_axes})
    literal = arm * LIGHT_M_S2 / (inertia_factor(engine, dimension) * RADIUS_M)
    exact = literal if rolling_axes == "all" else 0.0
    yield Measured(
        f"slowing of a twist, {rolling_axes} axes", found, exact, 1e-8 * literal, "rad/s2"
    )


@case("(39)", "1e-8: round-off; moment and damping are constant", form=FORMS)
def spin_with_nonviscous_damping(engine: str, dimension: int, form: str) -> Iterator[Measured]:
    """The rolling moment on a smooth floor slows a spin, and the damping (39) adds its share of it.

    w' = -(1 + alpha_nvr) tan(alpha) g/(kappa r). In 3D the moment lies along the spin. So both
    forms of damping must give the same.
    """
    arm, share = 0.1, 0.3
    damping = {"form": form, "nonviscous_translation": 0.0, "nonviscous_rotation": share}
    found = _slowing(engine, dimension, spin(dimension, 1.0), arm, background_damping=damping)
    kappa = inertia_factor(engine, dimension)
    exact = (1 + share) * arm * LIGHT_M_S2 / (kappa * RADIUS_M)
    yield Measured(f"slowing of a rolling spin, {form}", found, exact, 1e-8 * exact, "rad/s2")
