"""A grain on a plate turned by an angle: the friction and the rolling angle."""

from __future__ import annotations

import math
from collections.abc import Iterator

import numpy as np

from tests.verification.cases.bench import (
    LIGHT_M_S2,
    OMEGA_RAD_S,
    RADIUS_M,
    Array,
    Bench,
    inertia_factor,
    law,
    scene,
)
from tests.verification.cases.case import Measured, case

SIZE_M = (0.08, 0.02)


def _axes(dimension: int, angle_rad: float) -> tuple[Array, Array]:
    """Unit vectors down the plate and out of it; the plate rises along x."""
    c, s = math.cos(angle_rad), math.sin(angle_rad)
    if dimension == 2:
        return np.array([-c, -s]), np.array([-s, c])
    return np.array([-c, 0.0, -s]), np.array([-s, 0.0, c])


def descent(
    engine: str, dimension: int, angle_rad: float, friction: float, arm: float, periods: int
) -> tuple[float, float, float]:
    """Release a grain at rest on the plate.

    Returns
    -------
    acceleration : float, m/s2
        Down the plate, from the means of the speed over two periods of the tangential spring,
        one in the middle and one at the end.
    spinning_up : float, rad/s2
        The same of the spin that rolls down.
    kappa : float
    """
    kappa = inertia_factor(engine, dimension)
    period = 2 * math.pi / (OMEGA_RAD_S * math.sqrt(1 + 1 / kappa))
    middle = [0.1, 0.1] if dimension == 2 else [0.1, 0.1, 0.1]
    size = SIZE_M if dimension == 2 else (SIZE_M[0], 0.05, SIZE_M[1])
    plate = {
        "kind": "plate", "centre_m": middle, "size_m": size, "angle_deg": math.degrees(angle_rad),
    }  # fmt: skip
    given = scene(
        engine,
        dimension,
        wall=law(dimension, 0.5, friction, arm),
        step_s=period / 80,
        gravity_m_s2=LIGHT_M_S2,
        obstacles=[plate],
    )
    down, out = _axes(dimension, angle_rad)
    sag = LIGHT_M_S2 * math.cos(angle_rad) / OMEGA_RAD_S**2
    place = np.array(middle) + out * (SIZE_M[1] / 2 + RADIUS_M - sag) - 0.011 * down
    if dimension == 3:
        place[1] += 0.007
    with Bench(given) as bench:
        bench.place([place])
        means = []
        for rest in (periods // 2 - 1, periods - periods // 2 - 1):
            bench.advance(rest * period)
            states = [bench.advance(period / 10) for _ in range(10)]
            # Rolling down is a spin about +z in 2D and about -y in 3D: the plate rises along x.
            w = np.mean([s.spin_rad_s[0, 2] if dimension == 2 else -s.spin_rad_s[0, 1]
                         for s in states])  # fmt: skip
            v = np.mean([s.velocity_m_s[0] @ down for s in states])
            means.append((np.mean([s.time_s for s in states]), v, w))
        (t_0, v_0, w_0), (t_1, v_1, w_1) = means
    return float((v_1 - v_0) / (t_1 - t_0)), float((w_1 - w_0) / (t_1 - t_0)), kappa


@case(
    "(25)-(28)",
    "5e-4 of g: the tangential and the rolling spring swing on; sliding 1e-5 of g",
    beyond_deg=[-2.0, 2.0],
)
def block_at_the_friction_angle(
    engine: str, dimension: int, beyond_deg: float
) -> Iterator[Measured]:
    """A grain that cannot roll, tan(alpha) = 1, is a block: it sticks below atan(mu), slides above.

    Sliding, v' = g (sin(beta) - mu cos(beta)). The moment of friction, mu N r, stays below the
    rolling moment, tan(alpha) N r, so nothing rolls.
    """
    mu = 0.4
    angle = math.atan(mu) + math.radians(beyond_deg)
    found, turning, _ = descent(engine, dimension, angle, mu, 1.0, 120)
    exact = max(0.0, LIGHT_M_S2 * (math.sin(angle) - mu * math.cos(angle)))
    label = f"{beyond_deg:+g} deg beyond atan(mu)"
    share = 1e-5 if exact > 0.0 else 5e-4
    yield Measured(f"acceleration, {label}", found, exact, share * LIGHT_M_S2, "m/s2")
    yield Measured(f"r w', {label}", RADIUS_M * turning, 0.0, 5e-4 * LIGHT_M_S2, "m/s2")


@case("(22)-(28)", "1e-4 of g: the sag, 1e-5 of the radius, shortens the arm")
def sliding_down_while_turning(engine: str, dimension: int) -> Iterator[Measured]:
    """Without rolling resistance a grain slides beyond tan(beta) = mu (1 + 1/kappa), and turns.

    v' = g (sin(beta) - mu cos(beta)), r w' = mu g cos(beta)/kappa.
    """
    mu, angle = 0.2, math.radians(40.0)
    found, turning, kappa = descent(engine, dimension, angle, mu, 0.0, 60)
    exact = LIGHT_M_S2 * (math.sin(angle) - mu * math.cos(angle))
    yield Measured("acceleration", found, exact, 1e-4 * LIGHT_M_S2, "m/s2")
    exact = mu * LIGHT_M_S2 * math.cos(angle) / kappa
    yield Measured("r w'", RADIUS_M * turning, exact, 1e-4 * LIGHT_M_S2, "m/s2")


@case(
    "(29)-(30)",
    "2e-4 of g: the tangential spring swings on; rolling 2e-6",
    beyond_deg=[-1.0, 1.0],
)
def disc_at_the_rolling_angle(engine: str, dimension: int, beyond_deg: float) -> Iterator[Measured]:
    """A rough grain rests below the angle alpha of (30) and rolls above it.

    (I + m r^2) w' = m g r (sin(beta) - tan(alpha) cos(beta)), so
    v' = g (sin(beta) - tan(alpha) cos(beta))/(1 + kappa).
    """
    arm = 0.1
    angle = math.atan(arm) + math.radians(beyond_deg)
    found, _, kappa = descent(engine, dimension, angle, 0.8, arm, 120)
    exact = LIGHT_M_S2 * (math.sin(angle) - arm * math.cos(angle)) / (1 + kappa)
    label = f"{beyond_deg:+g} deg beyond alpha"
    share = 2e-6 if exact > 0.0 else 2e-4
    yield Measured(f"acceleration, {label}", found, max(0.0, exact), share * LIGHT_M_S2, "m/s2")
