"""What accuracy costs: error of an impact with a closed form against wall time of a bed."""

from __future__ import annotations

import math
from typing import Any

import numpy as np

from benchmarks.engines.beds import SPRING_N_M, opened, scene
from benchmarks.engines.timing import Extent
from sandmould.engines.program import build_program
from sandmould.engines.registry import engine_problem
from sandmould.scenario.scenario import Scenario

_SPEED_M_S = 0.01
_PHASES = 8
"""Pairs whose first touch falls at as many places within a time step."""
DASHPOTS = ("corrected", "plain")
EXACT = math.exp(-2)
"""Restitution at critical damping where no contact pulls (Schwager and Poeschel 2007)."""


def _pairs_scene(engine: str, fraction: float, dashpot: str) -> Scenario:
    """Pairs of the smallest discs of the bed, with its law, without gravity."""
    smallest = scene(2, 1, 0.3, 0.3).sand.classes(2)[0].diameter_m
    sieve = [
        {"opening_m": smallest / 1.001, "passing_fraction": 0.0},
        {"opening_m": smallest * 1.001, "passing_fraction": 1.0},
    ]
    return scene(
        2, 2 * _PHASES, 0.3, 0.3, engine,
        gravity_m_s2=0.0,
        contact={"dashpot": dashpot},
        sand={"sieve": sieve, "size_scale": 1.0, "size_classes": 1},
        time_step={"fraction": fraction},
        # Beyond where the layer would be dropped from, LAMMPS and LIGGGHTS drop grains.
        fill={"drop_height_m": 0.3, "settling": {"shortest_s": 4.0}},
    )  # fmt: skip


def restitution_error(engine: str, fraction: float, dashpot: str) -> tuple[float, float]:
    """Time step (s), and root mean square of the relative error over the phases."""
    scenario = _pairs_scene(engine, fraction, dashpot)
    step_s = scenario.step_s
    with opened(scenario) as session:
        radius = session.snapshot().radius_m[0]
        mass = scenario.sand.grain_mass_kg(2 * radius, 2)
        gap = _SPEED_M_S * step_s * (1 + np.arange(_PHASES) / _PHASES)
        place = np.zeros((2 * _PHASES, 2))
        place[0::2, 0], place[1::2, 0] = 0.1, 0.1 + 2 * radius + gap
        place[:, 1] = np.repeat(0.02 + 0.02 * np.arange(_PHASES), 2)
        velocity = np.zeros_like(place)
        velocity[0::2, 0], velocity[1::2, 0] = _SPEED_M_S / 2, -_SPEED_M_S / 2
        session.set_state(place, velocity, np.zeros((2 * _PHASES, 3)))
        session.start_stage(build_program(scenario).stages[0])
        # At critical damping the contact lasts for 2/omega.
        session.advance(4 * step_s + 3 / math.sqrt(2 * SPRING_N_M / mass))
        after = session.snapshot().velocity_m_s[:, 0]
    error = (after[1::2] - after[0::2]) / _SPEED_M_S / EXACT - 1
    return step_s, float(np.sqrt((error**2).mean()))


def measure_accuracy(bed: dict[str, Any], extent: Extent) -> list[dict[str, Any]]:
    """Curve of each engine: cost of a second of a bed whose rates are known, error of an impact.

    Parameters
    ----------
    bed : dict
        What ``measure_bed`` found for the smaller bed of discs.
    extent : Extent
    """
    rows = []
    for dashpot in DASHPOTS:
        for name, row in bed["engines"].items():
            if engine_problem(_pairs_scene(name, 0.5, dashpot)) is not None:
                continue
            rate = row["grain_steps_per_s"]["median"]
            for fraction in extent.fractions:
                step_s, error = restitution_error(name, fraction, dashpot)
                rows.append({
                    "engine": name,
                    "dashpot": dashpot,
                    "fraction": fraction,
                    "step_s": step_s,
                    "error": error,
                    "wall_s_per_s": bed["grains"] / step_s / rate,
                })  # fmt: skip
    return rows
