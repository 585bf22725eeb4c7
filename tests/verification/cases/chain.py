"""A bar of grains clamped between two walls: a chain of masses and springs."""

from __future__ import annotations

import math
from collections.abc import Iterator

import numpy as np

from tests.verification.cases.bench import (
    LIGHT_M_S2,
    OMEGA_RAD_S,
    RADIUS_M,
    Bench,
    crossing,
    law,
    mass_kg,
    scene,
    stiffness,
    vector,
)
from tests.verification.cases.case import Measured, case

GRAINS = 8


def clamped(engine: str, dimension: int, wall_stiffness: float) -> tuple[Bench, np.ndarray, float]:
    """A bar of grains pressed between the side walls, where they lie and their prestress, N."""
    unit = stiffness(dimension)
    press = 1e-4 * RADIUS_M * unit
    overlap, at_wall = press / unit, press / (wall_stiffness * unit)
    width = 2 * RADIUS_M * GRAINS - (GRAINS - 1) * overlap - 2 * at_wall
    given = scene(
        engine,
        dimension,
        GRAINS,
        wall=law(dimension, normal=wall_stiffness),
        step_s=5e-6,
        box={"width_m": width},
        rest={"load_every_steps": 1, "check_every_s": 5e-5},
    )
    place = np.tile(vector(dimension, 0.0, 0.05), (GRAINS, 1))
    place[:, 0] = RADIUS_M - at_wall + np.arange(GRAINS) * (2 * RADIUS_M - overlap)
    if dimension == 3:
        place[:, 1] = 0.1
    return Bench(given), place, press


@case(
    "(3)-(5), (16)",
    "1e-5: (omega dt)^2/24 at a step of 1e-2/omega is 4e-6 of the highest mode seen",
    wall_stiffness=[1.0, 0.3],
)
def modes_of_a_bar(engine: str, dimension: int, wall_stiffness: float) -> Iterator[Measured]:
    """Eight equal grains in a row, all contacts closed by a prestress, undamped and smooth.

    m u_i'' = k (u_(i+1) - 2 u_i + u_(i-1)), and the walls' springs k_w hold the ends. With k_w = k
    the modes are sin(j pi i/(n + 1)) with omega_j = 2 sqrt(k/m) sin(j pi/(2 (n + 1))). With other
    walls they are the eigenvectors of that matrix. Three modes are started at once by velocities of
    their shapes. The part of each in the motion vanishes again after whole periods.
    """
    matrix = 2.0 * np.eye(GRAINS) - np.eye(GRAINS, k=1) - np.eye(GRAINS, k=-1)
    matrix[0, 0] = matrix[-1, -1] = 1.0 + wall_stiffness
    values, shapes = np.linalg.eigh(matrix)
    omegas = OMEGA_RAD_S * np.sqrt(values)
    if wall_stiffness == 1.0:
        j = np.arange(1, GRAINS + 1)
        omegas = 2 * OMEGA_RAD_S * np.sin(j * math.pi / (2 * (GRAINS + 1)))
    bench, place, _ = clamped(engine, dimension, wall_stiffness)
    with bench:
        velocity = np.zeros_like(place)
        # Much less than the prestress opens.
        velocity[:, 0] = 1e-2 * 1e-4 * RADIUS_M * OMEGA_RAD_S * shapes[:, :3].sum(axis=1)
        bench.place(place, velocity)
        found = {}
        # Highest first: its whole periods end first. Three periods of each.
        for mode in (2, 1, 0):
            ends = 3 * 2 * math.pi / omegas[mode]
            now = bench.session.time_s
            bench.advance(0.995 * ends - now)
            states = [bench.advance(0.001 * ends) for _ in range(10)]
            part = np.array([shapes[:, mode] @ (s.position_m[:, 0] - place[:, 0]) for s in states])
            found[mode] = 6 * math.pi / crossing(np.array([s.time_s for s in states]), part)
    for mode in (0, 1, 2):
        exact = omegas[mode]
        yield Measured(
            f"omega_{mode + 1}, k_w = {wall_stiffness:g} k", found[mode], exact, 1e-5 * exact,
            "rad/s",
        )  # fmt: skip


@case("(16), (56)", "1e-9: round-off of overlaps of 2e-7 m at places of 3e-2 m")
def loads_of_a_clamped_bar(engine: str, dimension: int) -> Iterator[Measured]:
    """At rest the bar pushes both side walls outwards with its prestress, the floor not at all."""
    bench, place, press = clamped(engine, dimension, 0.3)
    with bench:
        bench.place(place)
        bench.session.advance()
        bench.session.advance()
        loads = bench.session.surface_loads()
    assert loads is not None
    for name, exact in (("left", -press), ("right", press), ("floor", 0.0)):
        yield Measured(f"load on {name} wall", loads[name][0], exact, 1e-9 * press, "N")


@case("(16), (56)", "1e-9: round-off")
def load_of_a_grain_at_rest(engine: str, dimension: int) -> Iterator[Measured]:
    """A grain that lies on the floor with the overlap m g/k loads it with its weight."""
    given = scene(
        engine,
        dimension,
        gravity_m_s2=LIGHT_M_S2,
        step_s=1e-5,
        rest={"load_every_steps": 1, "check_every_s": 1e-4},
    )
    weight = mass_kg(dimension) * LIGHT_M_S2
    with Bench(given) as bench:
        low = RADIUS_M - weight / stiffness(dimension)
        bench.place([vector(dimension, 0.05, low)])
        bench.session.advance()
        bench.session.advance()
        loads = bench.session.surface_loads()
    assert loads is not None
    yield Measured("load on the floor", loads["floor"][-1], -weight, 1e-9 * weight, "N")
