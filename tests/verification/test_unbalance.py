"""A table with an unbalance against exact motions: empty, under a block, under a thrown grain."""

from __future__ import annotations

import cmath
import math
from dataclasses import dataclass
from typing import Any

import numpy as np
import pytest

from sandmould.engines.table_periods import TablePeriod
from sandmould.scenario.drive import steady_drive
from sandmould.scenario.scenario import Scenario
from tests.verification.cases.bench import (
    OMEGA_RAD_S,
    RADIUS_M,
    Bench,
    law,
    mass_kg,
    scene,
    vector,
)

STEP_S = 2e-5
GRAVITY_M_S2 = 9.80665
MOUNT_HZ, DAMPING = 20.0, 0.1
SHARE = {2: 5.0, 3: 1.0}
"""How often the table feels the grain: in 2D a flask of 0.5 m over discs of 0.1 m."""


@dataclass(frozen=True)
class Shaken:
    """What became of a table in a whole vibration."""

    scenario: Scenario
    periods: list[TablePeriod]
    energy_j: tuple[float, float]
    """Of one grain in the laboratory before and after, with its spring to the floor."""


def table_scene(
    dimension: int, table_kg: float, frequency_hz: float, moment_kg_m: float, **changes: Any
) -> Scenario:
    unbalance = {
        "moment_kg_m": moment_kg_m,
        "moving_mass_kg": table_kg,
        "mount_frequency_hz": MOUNT_HZ,
        "mount_damping_ratio": DAMPING,
    }
    if dimension == 2:
        unbalance["flask_depth_m"] = 0.1 * SHARE[2]
    stage = {
        "hold": "unbalance", "unbalance": unbalance, "frequency_hz": frequency_hz,
        "duration_s": changes.pop("duration_s", 0.8),
    }  # fmt: skip
    return scene(
        "reference",
        dimension,
        **{
            "step_s": STEP_S,
            "vibration": [stage],
            "measure_at_rest": False,
            "rest": {"load_every_steps": 50, "check_every_s": 5e-3},
        }
        | changes,
    )


def shake(scenario: Scenario, height_m: float) -> Shaken:
    """One grain, at rest at a height over the floor, on the table from the start on."""
    dimension = scenario.dimension
    with Bench(scenario) as bench:
        session: Any = bench.session
        bench.place([vector(dimension, 0.1, height_m)], stage=-1)
        before = _energy_j(bench)
        while not session.stage_over:
            session.advance()
        return Shaken(scenario, session.table_periods(), (before, _energy_j(bench)))


def _energy_j(bench: Bench) -> float:
    """Kinetic energy of the grain in the laboratory, elastic energy, and weight times height.

    The height is that over the floor: what the resting weight does to the table as a whole, the
    mounts' pre-load takes up.
    """
    session: Any = bench.session
    now, mass = bench.state(), mass_kg(bench.scenario.dimension)
    places = session.solver.table_places_m
    height_m, speed = float(now.position_m[0, -1]), now.velocity_m_s[0].copy()
    speed[-1] += (places[1] - places[0]) / STEP_S
    overlap_m = max(0.0, RADIUS_M - height_m)
    kinetic = 0.5 * mass * float(speed @ speed)
    potential = mass * bench.scenario.gravity_m_s2 * height_m
    return kinetic + potential + 0.5 * mass * OMEGA_RAD_S**2 * overlap_m**2


def response(
    table_kg: float, frequency_hz: float, moment_kg_m: float, added_kg: complex = 0.0
) -> complex:
    """m e omega^2/(K - (M + added) omega^2 + i omega C), m."""
    omega, mount = 2 * math.pi * frequency_hz, 2 * math.pi * MOUNT_HZ
    stiffness, damping = table_kg * mount**2, 2 * DAMPING * table_kg * mount
    dynamic = stiffness - (table_kg + added_kg) * omega**2 + 1j * omega * damping
    return moment_kg_m * omega**2 / dynamic


def measured(shaken: Shaken) -> complex:
    """Steady amplitude and phase as a report takes them, as a complex amplitude."""
    drive = steady_drive(
        shaken.scenario.vibrations[0],
        np.array([p.displacement_m for p in shaken.periods]),
        np.array([p.phase_deg for p in shaken.periods]),
    )
    assert drive is not None
    last = shaken.periods[-1]
    assert last.displacement_m == pytest.approx(drive.displacement_m, rel=2e-3)
    return cmath.rect(drive.displacement_m, -math.radians(last.phase_deg))


@pytest.mark.parametrize("frequency_hz", [10.0, 16.0, 20.0, 25.0, 40.0, 80.0])
def test_an_empty_table_moves_as_an_oscillator(frequency_hz: float) -> None:
    """Below, at and above its resonance, in amplitude and phase; the one grain floats.

    1e-3: what is left of the start in the second half is at most exp(-12.6 0.4) in its first period
    and on average a tenth of that, out of phase with the drive; central differences differ by
    (omega dt)^2/12 < 1e-5.
    """
    shaken = shake(table_scene(3, 2.0, frequency_hz, 1e-3, duration_s=1.6), 0.1)
    exact = response(2.0, frequency_hz, 1e-3)
    assert abs(measured(shaken) - exact) < 1e-3 * abs(exact)
    assert shaken.scenario.vibrations[0].amplitude_m == pytest.approx(abs(exact), rel=1e-12)


@pytest.mark.parametrize("dimension", [2, 3])
@pytest.mark.parametrize("frequency_hz", [16.0, 40.0])
def test_a_block_held_to_the_floor_is_added_mass(dimension: int, frequency_hz: float) -> None:
    """One grain that never leaves the floor: added mass m T, with T = 1 of a rigid block.

    T = (1 + 2 i zeta r)/(1 - r^2 + 2 i zeta r), r = omega/omega_contact, is how much more than a
    rigid one a grain on a spring and a dashpot moves: 1.6 % at 40 Hz. 2e-3: the dashpot takes the
    velocity of half a step before, omega dt/2 = 2.5e-3 of its share; the start has died away to
    1e-3.
    """
    grain_kg = SHARE[dimension] * mass_kg(dimension)
    table_kg, zeta = 2.0 * grain_kg, 0.5
    moment = table_kg * 2e-5
    scenario = table_scene(
        dimension, table_kg, frequency_hz, moment, duration_s=1.6,
        gravity_m_s2=GRAVITY_M_S2, wall=law(dimension, zeta),
    )  # fmt: skip
    shaken = shake(scenario, RADIUS_M - GRAVITY_M_S2 / OMEGA_RAD_S**2)
    r = 2 * math.pi * frequency_hz / OMEGA_RAD_S
    follows = (1 + 2j * zeta * r) / (1 - r**2 + 2j * zeta * r)
    exact = response(table_kg, frequency_hz, moment, grain_kg * follows)
    assert abs(exact) * (2 * math.pi * frequency_hz) ** 2 < 0.6 * GRAVITY_M_S2, "it is thrown"
    assert abs(measured(shaken) - exact) < 2e-3 * abs(exact)
    rigid = abs(response(table_kg, frequency_hz, moment, grain_kg))
    assert abs(measured(shaken)) == pytest.approx(rigid, rel=0.03)
    empty = abs(response(table_kg, frequency_hz, moment))
    assert abs(abs(measured(shaken)) / empty - 1.0) > 0.2, "the block must count"
    # What the sand takes is what its dashpot takes: c |omega U|^2/2 a second, U = X (T - 1).
    # 2 %: half a step of a dashpot is a spring of c dt/2, 2 % of the contact's.
    dashpot = 2 * zeta * grain_kg * OMEGA_RAD_S
    loss = math.pi * 2 * math.pi * frequency_hz * dashpot * abs(exact * (follows - 1)) ** 2
    assert shaken.periods[-1].sand_work_j == pytest.approx(loss, rel=0.02)


@pytest.mark.parametrize("dimension", [2, 3])
@pytest.mark.parametrize("frame", ["box", "laboratory"])
def test_the_energy_of_a_table_with_a_thrown_grain_closes(dimension: int, frame: str) -> None:
    """Work of the unbalance = loss in the mounts + energy of the table + energy of the grain.

    The grain bounces without loss and keeps a quarter of what the unbalance gives. 1 %: the grain's
    state is taken up to two steps after the end of the last period, 0.2 % of the work here.
    """
    table_kg = 0.5 * SHARE[dimension] * mass_kg(dimension)
    scenario = table_scene(
        dimension, table_kg, 40.0, table_kg * 5e-4, duration_s=0.2,
        gravity_m_s2=GRAVITY_M_S2, frame=frame,
    )  # fmt: skip
    shaken = shake(scenario, RADIUS_M)
    work, loss, on_sand = (
        sum(getattr(p, name) for p in shaken.periods)
        for name in ("unbalance_work_j", "mount_loss_j", "sand_work_j")
    )
    before, after = (SHARE[dimension] * energy for energy in shaken.energy_j)
    assert after - before > 0.1 * work, "the grain must count"
    kept = shaken.periods[-1].table_energy_j
    assert work == pytest.approx(loss + on_sand + kept, rel=1e-3)
    assert work == pytest.approx(loss + kept + after - before, rel=0.01)
