"""Where each engine loses stability: a map over time step and damping, and the exact limits."""

from __future__ import annotations

import itertools
import math
from collections.abc import Iterable
from dataclasses import dataclass
from typing import Any

import numpy as np

from benchmarks.stability.runs import STABLE, disturb, follow_bed
from benchmarks.stability.scenes import RADIUS_M, Opened, limits_of, scenario_of
from sandmould.engines.registry import engine_of, engine_problem

ENGINES = ("reference", "lammps", "liggghts")


@dataclass(frozen=True)
class MapGrid:
    """Where the maps are computed."""

    damping_ratios: tuple[float, ...]
    steps_over_critical: tuple[float, ...]
    """Time steps over that of (41); none lies on a limit of (42), where neither outcome is
    wrong."""
    halvings: int
    beyond: tuple[float, ...]
    """Steps over the exact limit with which the bed is followed for long."""


WHOLE = MapGrid(
    (0.0, 0.1, 0.25, 0.5, 0.75, 1.0),
    (0.05, 0.1, 0.2, 0.3, 0.38, 0.46, 0.55, 0.65, 0.75, 0.85, 0.94, 0.98, 1.02, 1.06, 1.25, 1.5,
     2.0),
    5,
    (1.05, 1.2, 1.5, 2.0),
)  # fmt: skip
COARSE = MapGrid((0.0, 1.0), (0.1, 0.38, 0.94, 1.06, 2.0), 1, (1.2,))
"""Enough to see that everything works."""
SLOPE_DEG = 10.0


def engines_here() -> dict[str, str]:
    """Engines that are installed, with their versions; that of the reference is the source's."""
    versions = {}
    for name in ENGINES:
        if engine_problem(scenario_of("bed", name, 0.0)) is None:
            version = engine_of(scenario_of("bed", name, 0.0)).installed_version()
            versions[name] = "of this tree" if name == "reference" else str(version)
    return versions


def measured_limit(
    scene: str, engine: str, damping_ratio: float, stable: float, grown: float, halvings: int
) -> float:
    """Largest stable step over that of (41), by halving the interval that the map leaves."""
    critical_s = limits_of(scene, 0.0).whole.undamped_s
    for _ in range(halvings):
        middle = (stable + grown) / 2
        disturbed = disturb(scene, engine, damping_ratio, middle * critical_s, follow=False)
        stable, grown = (middle, grown) if disturbed.outcome == STABLE else (stable, middle)
    return (stable + grown) / 2


def map_of(scene: str, engine: str, grid: MapGrid) -> list[dict[str, Any]]:
    """Outcomes at all time steps and damping ratios, and the limits between them."""
    critical_s = limits_of(scene, 0.0).whole.undamped_s
    rows, steps = [], grid.steps_over_critical
    for zeta in grid.damping_ratios:
        runs = [disturb(scene, engine, zeta, x * critical_s, True) for x in steps]
        outcomes = [run.outcome for run in runs]
        first = next(i for i, outcome in enumerate(outcomes) if outcome != STABLE)
        stable, grown = steps[first - 1], steps[first]
        limit = measured_limit(scene, engine, zeta, stable, grown, grid.halvings)
        rows.append({
            "damping_ratio": zeta,
            "outcomes": outcomes,
            "rise_of_centre": [
                None if math.isnan(run.rise) else float(f"{run.rise:.2g}") for run in runs
            ],
            "largest_stable_over_critical": round(limit, 4),
            "known_within": round((grown - stable) / 2 ** (grid.halvings + 1), 5),
        })  # fmt: skip
        print(f"{scene:8} {engine:10} zeta {zeta:4}: stable up to {limit:.3f}", flush=True)
    return rows


def one_contact_s(damping_ratio: float) -> float:
    """The paper's step for the smallest grain of the bed with one contact, (42), (51) and (54)."""
    s = scenario_of("bed", "reference", damping_ratio)
    law, smallest = s.laws.grain_grain, s.sand.classes(2)[0].diameter_m
    mass = s.sand.grain_mass_kg(smallest, 2)
    along = 2 * math.sqrt(mass / law.normal_stiffness_n_m)
    about = 2 * math.sqrt(s.sand.inertia_factor(2) * mass / law.tangential_stiffness_n_m)
    return min(along * (math.hypot(1, damping_ratio) - damping_ratio), about)


def limit_row(scene: str, damping_ratio: float, inertia: str = "physical") -> dict[str, float]:
    """Critical steps of a scene by all estimates, s."""
    limits = limits_of(scene, damping_ratio, inertia)
    steps = {
        "simplified": limits.simplified.damped_s,
        "grain": limits.grain.damped_s,
        "whole": limits.whole.damped_s,
        "planned": limits.planned_s,
    }
    return {"damping_ratio": damping_ratio} | {
        f"{k}_s": float(f"{v:.4g}") for k, v in steps.items()
    }


def rolling_acceleration_m_s2(inertia: str, disc_inertia: str) -> float:
    """Acceleration of a disc that rolls down a plate turned by 10 degrees, reference engine."""
    angle = math.radians(SLOPE_DEG)
    along = np.array([math.cos(angle), -math.sin(angle)])
    normal = np.array([math.sin(angle), math.cos(angle)])
    plate = {
        "kind": "plate", "centre_m": [0.2, 0.1], "size_m": [0.3, 0.01], "angle_deg": -SLOPE_DEG,
    }  # fmt: skip
    scenario = scenario_of(
        "contact",
        "reference",
        0.95,
        box={"width_m": 0.4, "height_m": 0.2},
        obstacles=[plate],
        sand={"disc_inertia": disc_inertia},
        contact={"grain_wall": {"friction": 0.8}},
        time_step={"rotational_inertia": inertia, "fraction": 0.5},
    )
    first = np.array([0.2, 0.1]) - 0.1 * along + (0.005 + RADIUS_M) * normal
    duration_s = 0.3
    with Opened(scenario) as opened:
        opened.begin(first[None], np.zeros((1, 2)))
        opened.session.advance(duration_s)
        last = opened.session.snapshot()
    way = float((last.position_m[0] - first) @ along)
    return 2 * way / last.time_s**2


def rotation(grid: MapGrid) -> dict[str, Any]:
    """What raised moments of inertia slow, and how much larger the step may be."""
    gravity = scenario_of("contact", "reference", 0.0).gravity_m_s2 * math.sin(
        math.radians(SLOPE_DEG)
    )
    rolling = []
    for name, c in (("disc", 0.5), ("sphere", 0.4)):
        physical, scaled = (rolling_acceleration_m_s2(i, name) for i in ("physical", "scaled"))
        rolling.append({
            "inertia": name,
            "physical_m_s2": round(physical, 4),
            "scaled_m_s2": round(scaled, 4),
            "factor": round(scaled / physical, 4),
            "exact_physical_m_s2": round(gravity / (1 + c), 4),
            "exact_factor": round((1 + c) / 2, 4),
        })  # fmt: skip
    scaled_steps = [limit_row("bed", zeta, "scaled") for zeta in grid.damping_ratios]
    return {"rolling": rolling, "bed_scaled": scaled_steps}


def followed_beds(engines: Iterable[str], grid: MapGrid) -> list[dict[str, Any]]:
    """What a study's guards see of a bed beyond its limit."""
    rows = []
    for zeta, factor in itertools.product((0.0, 0.5, 1.0), grid.beyond):
        step_s = factor * limits_of("bed", zeta).whole.damped_s
        row: dict[str, Any] = {"damping_ratio": zeta, "step_over_limit": factor}
        for engine in engines:
            followed = follow_bed(engine, zeta, step_s)
            row[engine] = {"outcome": followed.outcome}
            if followed.outcome == "not noticed":
                row[engine]["rms_speed_m_s"] = float(f"{followed.rms_speed_m_s:.2g}")
                row[engine]["rise"] = float(f"{followed.rise:.2g}")
        rows.append(row)
    return rows
