"""The scenes disturbed a little, and what becomes of them with a given time step.

The disturbance is a ten thousandth of the speed g/omega of a grain that swings through its own
sag: no contact opens or slips before the kinetic energy has grown a thousandfold, so what decides
first is the linear stability of (40)-(42).
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from benchmarks.stability.scenes import Array, Opened, limits_of, scenario_of, start_of
from sandmould.engines.guard import Guard
from sandmould.engines.session import EngineStop
from sandmould.scenario.scenario import Scenario

STABLE, DRIFTS, BLOWS_UP = "stable", "drifts", "blows up"
STEPS = 2048
LOOKS = tuple(sorted({round(2 ** (k / 2)) for k in range(2, 15)} | set(range(256, 2049, 128))))
"""Steps after which the state is looked at: an energy that passed one look below the bound has at
most squared at the next, so no number overflows inside an engine."""
GROWN = 1e3
"""Kinetic energy over that of the disturbance beyond which the disturbance has grown. Next to the
limit a bounded swing of central differences has 1 / (1 - (omega dt / 2)^2), 50 at 0.99."""
BLOWN = 1e11
"""Ratio at which a run has blown up: grains move 32 times as fast as through their sag."""
GROWTH = 2.0
"""Largest kinetic energy of the second half of a run over that of the first; more is drift."""
SAGS = 1.0
"""Way of the centre of mass, in sags of one grain under its weight; more is drift."""
DISTURBANCE = 1e-4
"""Speed over g/omega. At 0.01 friction at the bed's lightest contacts already holds the slowest
growth back, and the bed seems stable up to 1.3 % beyond its limit."""


@dataclass(frozen=True)
class Followed:
    """What a study would see of a bed computed for long with too large a step."""

    outcome: str
    """What the guards say."""
    rms_speed_m_s: float
    rise: float
    """Rise of the centre of mass over its height."""


@dataclass(frozen=True)
class DisturbanceResult:
    """What became of a disturbance."""

    outcome: str
    energy_ratio: float
    """Largest kinetic energy over that of the disturbance; infinite where there was no number."""
    rise: float
    """Rise of the centre of mass over its height; not a number where there was none."""


def _disturbance(scene: str, scenario: Scenario) -> Array:
    """Velocities of a given root mean square, always the same; up and down alone in a column."""
    start, omega = start_of(scene), limits_of(scene, 0.0).whole.omega_rad_s
    velocity = np.random.default_rng(7).standard_normal(start.position_m.shape)
    if scene != "bed":
        velocity[:, 0] = 0.0
    energy = float(start.mass_kg @ (velocity**2).sum(axis=1))
    speed_m_s = DISTURBANCE * scenario.gravity_m_s2 / omega
    return velocity * speed_m_s * math.sqrt(start.mass_kg.sum() / energy)


def disturb(
    scene: str, engine: str, damping_ratio: float, step_s: float, follow: bool
) -> DisturbanceResult:
    """Disturb a scene at rest, compute up to 2 048 steps, and say what became of it.

    Parameters
    ----------
    scene, engine : str
    damping_ratio : float
        Of all contacts.
    step_s : float
    follow : bool
        Whether to go on when the disturbance has grown, to see where it ends.

    Notes
    -----
    The kinetic energy is that of the velocities of central differences, (x - x-) / dt: at whole
    steps a swing of alternating sign has hardly any.
    """
    start = start_of(scene)
    scenario = _forced(scenario_of(scene, engine, damping_ratio), step_s)
    velocity = _disturbance(scene, scenario)
    first = float(start.mass_kg @ (velocity**2).sum(axis=1))
    looks: list[tuple[int, float]] = []
    with Opened(scenario) as opened:
        session = opened.session
        opened.begin(start.position_m, velocity)
        try:
            for look in LOOKS:
                if look - session.steps > 1:
                    session.advance((look - 1 - session.steps) * step_s)
                before = session.snapshot().position_m
                session.advance(step_s)
                after = session.snapshot().position_m
                moved = float(start.mass_kg @ ((after - before) ** 2).sum(axis=1)) / step_s**2
                looks.append((look, moved / first))
                if not moved / first < (BLOWN if follow else GROWN):
                    break
        except EngineStop:
            looks.append((session.steps, math.inf))
    highest = max(ratio for _, ratio in looks)
    if not highest < BLOWN:
        return DisturbanceResult(BLOWS_UP, highest, math.nan)
    early = max(ratio for step, ratio in looks if step <= STEPS // 2)
    late = max((ratio for step, ratio in looks if step > STEPS // 2), default=0.0)
    height = float(start.mass_kg @ start.position_m[:, 1])
    way = float(start.mass_kg @ (after - start.position_m)[:, 1])
    weight = scenario.gravity_m_s2 * float(start.mass_kg.min())
    sag = weight / scenario.laws.grain_wall.normal_stiffness_n_m
    sinks = abs(way) > SAGS * sag * start.mass_kg.sum()
    drifts = highest > GROWN or late > max(1.0, GROWTH * early) or sinks
    return DisturbanceResult(DRIFTS if drifts else STABLE, highest, way / height)


def _forced(scenario: Scenario, step_s: float) -> Scenario:
    """The scene with this time step, however long: a study would take it after its fill alone."""
    fraction = step_s / scenario.critical_step.step_s
    forced = scenario.time_step.model_copy(update={"fraction": fraction})
    return scenario.model_copy(update={"time_step": forced})


def follow_bed(engine: str, damping_ratio: float, step_s: float) -> Followed:
    """Compute 10 000 steps of the disturbed bed under a study's own guards.

    Parameters
    ----------
    engine : str
    damping_ratio : float
    step_s : float
    """
    start = start_of("bed")
    scenario = _forced(scenario_of("bed", engine, damping_ratio), step_s)
    guard = Guard(scenario)
    speed, rise = math.nan, math.nan
    with Opened(scenario) as opened:
        session = opened.session
        opened.begin(start.position_m, _disturbance("bed", scenario))
        guard.start_stage(session.stage, session.snapshot())
        try:
            while session.steps < 10_000:
                session.advance(250 * step_s)
                snapshot = session.snapshot()
                speed = guard.check(snapshot).rms_speed_m_s
                height = start.mass_kg @ np.column_stack([snapshot.position_m, start.position_m])
                rise = float(height[1] / height[3]) - 1
        except EngineStop as stop:
            return Followed(stop.outcome.label, speed, rise)
    return Followed("not noticed", speed, rise)
