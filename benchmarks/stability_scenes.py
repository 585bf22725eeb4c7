"""Three scenes at rest, disturbed a little, and what becomes of them with a given time step.

One grain on the floor, a column of eight, and a settled bed. The disturbance is a ten thousandth
of the speed g/omega of a grain that swings through its own sag: no contact opens or slips before
the kinetic energy has grown a thousandfold, so what decides first is the linear stability of
(40)-(42).
"""

from __future__ import annotations

import math
import tempfile
from dataclasses import dataclass
from functools import cache
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from sandmould.dem.critical_step import (
    StableStep,
    active_contacts,
    grain_step,
    simplified_step,
    whole_step,
)
from sandmould.engines.choosing import engine_of
from sandmould.engines.guard import Guard, grain_masses_kg
from sandmould.engines.program import build_program
from sandmould.engines.session import EngineStop, Session
from sandmould.scenario.reading import Origin, merge
from sandmould.scenario.scenario import Scenario

Array = NDArray[np.float64]
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
RADIUS_M = 0.002
COLUMN, BED = 8, 200

_SMOOTH = {"friction": 0.0, "rolling_arm_fraction": 0.0}
_ONE_SIZE = {
    "size_scale": 1.0,
    "size_classes": 1,
    "sieve": [
        {"opening_m": 2 * RADIUS_M / 1.001, "passing_fraction": 0.0},
        {"opening_m": 2 * RADIUS_M * 1.001, "passing_fraction": 1.0},
    ],
}
_BASE: dict[str, Any] = {
    "box": {"width_m": 0.05, "height_m": 0.05},
    # A moment of inertia that LIGGGHTS has too, and no background damping, which it lacks.
    "sand": {"disc_inertia": "sphere"},
    "background_damping": {"form": "none"},
    # Never at rest before the end; LAMMPS keeps grains up to where a layer would be dropped from.
    "fill": {"drop_height_m": 0.1, "settling": {"shortest_s": 99.0, "longest_s": 100.0}},
    "record": {"load_every_steps": 100000},
}
SCENES: dict[str, dict[str, Any]] = {
    "contact": {
        "sand": _ONE_SIZE,
        "fill": {"layers": [{"count": 1}]},
        "contact": {"grain_grain": _SMOOTH, "grain_wall": _SMOOTH},
    },
    "column": {
        "sand": _ONE_SIZE,
        "fill": {"layers": [{"count": COLUMN}]},
        "contact": {"grain_grain": _SMOOTH, "grain_wall": _SMOOTH},
    },
    "bed": {"box": {"width_m": 0.035}, "fill": {"layers": [{"count": BED}]}},
}


@dataclass(frozen=True)
class Start:
    """Grains at rest under their weight, in the order of ids."""

    position_m: Array
    """(n, 2) float64, m."""
    mass_kg: Array
    """(n,) float64, kg."""


@dataclass(frozen=True)
class Limits:
    """Critical steps of a scene at one damping ratio."""

    simplified: StableStep
    grain: StableStep
    whole: StableStep
    planned_s: float


@dataclass(frozen=True)
class Followed:
    """What a study would see of a bed computed for long with too large a step."""

    outcome: str
    """What the guards say."""
    rms_speed_m_s: float
    rise: float
    """Rise of the centre of mass over its height."""


@dataclass(frozen=True)
class Run:
    """What became of a disturbance."""

    outcome: str
    energy_ratio: float
    """Largest kinetic energy over that of the disturbance; infinite where there was no number."""
    rise: float
    """Rise of the centre of mass over its height; not a number where there was none."""


def scenario_of(scene: str, engine: str, damping_ratio: float, **changes: Any) -> Scenario:
    """Make a scenario of a scene; what a study checks, such as its time step, is not."""
    law = {"damping_ratio": damping_ratio}
    merged = _BASE
    for more in (
        SCENES[scene],
        {"engine": {"name": engine}, "contact": {"grain_grain": law, "grain_wall": law}},
        changes,
    ):
        merged = merge(merged, more, Origin(), "benchmark")
    return Scenario.model_validate(merged)


class Opened:
    """A session on a scenario in a folder of its own, with its grains in the box."""

    def __init__(self, scenario: Scenario) -> None:
        self._folder = tempfile.TemporaryDirectory(prefix="stability_")
        folder = Path(self._folder.name)
        self.program = build_program(scenario)
        engine = engine_of(scenario)
        engine.write_deck(self.program, {}, folder, "stability", "stability")
        self.session: Session = engine.open_session(self.program, folder, folder / "engine.log")
        self.session.insert_layer(1)

    def __enter__(self) -> Opened:
        return self

    def __exit__(self, *_: object) -> None:
        self.session.close()
        self._folder.cleanup()

    def begin(self, position_m: Array, velocity_m_s: Array) -> None:
        """Put the grains in their places and begin."""
        self.session.set_state(position_m, velocity_m_s, np.zeros((len(position_m), 3)))
        self.session.start_stage(self.program.stages[0])


def _settled(scenario: Scenario, settle_s: float) -> Start:
    """Let grains fall and come to rest on the reference engine."""
    with Opened(scenario) as opened:
        opened.session.start_stage(opened.program.stages[0])
        opened.session.advance(settle_s)
        last = opened.session.snapshot()
    return Start(last.position_m, grain_masses_kg(scenario, last))


@cache
def start_of(scene: str) -> Start:
    """Rest of a scene with smooth contacts, which is one with rough contacts too.

    Without friction nothing but the places matters, and they are all that ``set_state`` takes:
    every engine begins with contacts that carry their loads and have not slipped.
    """
    damped = {
        "background_damping": {"form": "viscous", "viscous_translation_per_s": 100.0},
        "contact": {"grain_grain": _SMOOTH, "grain_wall": _SMOOTH},
        "time_step": {"fraction": 0.8},
        # They fall at g over the damping, 0.1 m/s.
        "fill": {"drop_height_m": 0.001},
    }
    scenario = scenario_of(scene, "reference", 0.5, **damped)
    if scene == "bed":
        return _settled(scenario, 1.2)
    law = scenario.contact.grain_grain.normal_stiffness_n_m
    wall = scenario.contact.grain_wall.normal_stiffness_n_m
    n = COLUMN if scene == "column" else 1
    mass = scenario.sand.grain_mass_kg(scenario.sand.classes(2)[0].diameter_m, 2)
    radius = scenario.sand.classes(2)[0].diameter_m / 2
    weight = mass * scenario.gravity_m_s2
    # Each contact carries the weight of all grains above it.
    height = (
        radius
        - n * weight / wall
        + np.concatenate(
            [[0.0], np.cumsum([2 * radius - (n - 1 - i) * weight / law for i in range(n - 1)])]
        )
    )
    # Beside the diagonal of the floor, along which LIGGGHTS splits it.
    position = np.column_stack([np.full(n, 0.011), height])
    return Start(position, np.full(n, mass))


@cache
def limits_of(scene: str, damping_ratio: float, rotational_inertia: str = "physical") -> Limits:
    """Critical steps of the contacts of a scene at rest."""
    changes = {"time_step": {"rotational_inertia": rotational_inertia}}
    scenario = scenario_of(scene, "reference", damping_ratio, **changes)
    start = start_of(scene)
    with Opened(scenario) as opened:
        opened.begin(start.position_m, np.zeros_like(start.position_m))
        contacts = active_contacts(opened.session.solver)  # type: ignore[attr-defined]
    steps = (estimate(contacts) for estimate in (simplified_step, grain_step, whole_step))
    return Limits(*steps, scenario.critical_step.step_s)


def _disturbance(scene: str, scenario: Scenario) -> Array:
    """Velocities of a given root mean square, always the same; up and down alone in a column."""
    start, omega = start_of(scene), limits_of(scene, 0.0).whole.omega_rad_s
    velocity = np.random.default_rng(7).standard_normal(start.position_m.shape)
    if scene != "bed":
        velocity[:, 0] = 0.0
    energy = float(start.mass_kg @ (velocity**2).sum(axis=1))
    speed_m_s = DISTURBANCE * scenario.gravity_m_s2 / omega
    return velocity * speed_m_s * math.sqrt(start.mass_kg.sum() / energy)


def disturb(scene: str, engine: str, damping_ratio: float, step_s: float, follow: bool) -> Run:
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
    scenario = scenario_of(scene, engine, damping_ratio, time_step={"step_s": step_s})
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
        return Run(BLOWS_UP, highest, math.nan)
    early = max(ratio for step, ratio in looks if step <= STEPS // 2)
    late = max((ratio for step, ratio in looks if step > STEPS // 2), default=0.0)
    height = float(start.mass_kg @ start.position_m[:, 1])
    way = float(start.mass_kg @ (after - start.position_m)[:, 1])
    weight = scenario.gravity_m_s2 * float(start.mass_kg.min())
    sag = weight / scenario.contact.grain_wall.normal_stiffness_n_m
    sinks = abs(way) > SAGS * sag * start.mass_kg.sum()
    drifts = highest > GROWN or late > max(1.0, GROWTH * early) or sinks
    return Run(DRIFTS if drifts else STABLE, highest, way / height)


def follow_bed(engine: str, damping_ratio: float, step_s: float) -> Followed:
    """Compute 10 000 steps of the disturbed bed under a study's own guards.

    Parameters
    ----------
    engine : str
    damping_ratio : float
    step_s : float
    """
    start = start_of("bed")
    scenario = scenario_of("bed", engine, damping_ratio, time_step={"step_s": step_s})
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
