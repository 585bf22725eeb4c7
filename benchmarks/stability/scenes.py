"""Three scenes at rest: one grain on the floor, a column of eight, and a settled bed."""

from __future__ import annotations

import tempfile
from dataclasses import dataclass
from functools import cache
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from sandmould.dem.critical_step import StableStep, active_contacts, whole_step
from sandmould.engines.guard import grain_masses_kg
from sandmould.engines.program import build_program
from sandmould.engines.registry import engine_of
from sandmould.engines.session import Session
from sandmould.scenario.reading import Origin, merge
from sandmould.scenario.scenario import Scenario
from tests.verification.grain_limits import grain_step, simplified_step

Array = NDArray[np.float64]
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
    "sand": {"disc_inertia": "sphere", "disc_thickness_m": 0.1},
    "background_damping": {"form": "none"},
    # Never at rest before the end; LAMMPS keeps grains up to where a layer would be dropped from.
    "fill": {"drop_height_m": 0.1, "settling": {"shortest_s": 99.0, "longest_s": 100.0}},
    "rest": {"load_every_steps": 100000},
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


def scenario_of(scene: str, engine: str, damping_ratio: float, **changes: Any) -> Scenario:
    """Make a scenario of a scene; what a study checks, such as its time step, is not.

    Dashpots are plain unless told: (42) is the limit of those.
    """
    law = {"damping_ratio": damping_ratio}
    merged = _BASE
    for more in (
        SCENES[scene],
        {
            "engine": {"name": engine},
            "contact": {"grain_grain": law, "grain_wall": law, "dashpot": "plain"},
        },
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
    law = scenario.laws.grain_grain.normal_stiffness_n_m
    wall = scenario.laws.grain_wall.normal_stiffness_n_m
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
    return Limits(
        simplified_step(contacts), grain_step(contacts), whole_step(contacts),
        scenario.critical_step.step_s,
    )  # fmt: skip
