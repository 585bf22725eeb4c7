"""Render a scenario into a LAMMPS deck and its layers of grains."""

from __future__ import annotations

import os
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from pydantic import BaseModel
from scipy.spatial.transform import Rotation

from sandmould.engines.deck import Deck, environment, exact
from sandmould.engines.lammps import OLDEST_VERSION
from sandmould.engines.program import Program, Stage
from sandmould.engines.step_counts import StepCounts
from sandmould.scenario.geometry import Array, Block
from sandmould.scenario.placement import PlannedLayer, predicted_bed_height_m
from sandmould.scenario.scenario import Scenario

HALF_SLAB_M = 0.0005


@dataclass(frozen=True)
class _Solid:
    """A block as a LAMMPS region: bounds before it is turned about its centre."""

    name: str
    bounds: str
    angle_rad: float
    centre: Array
    axis: Array


def _solid(block: Block) -> _Solid:
    d = len(block.centre_m)
    low, high = block.centre_m - block.half_size_m, block.centre_m + block.half_size_m
    bounds = " ".join(f"{exact(a)} {exact(b)}" for a, b in zip(low, high, strict=True))
    turn = np.eye(3)
    turn[:d, :d] = block.axes.T
    rotation = Rotation.from_matrix(turn).as_rotvec()
    angle = float(np.linalg.norm(rotation))
    axis = rotation / angle if angle > 0 else np.array([0.0, 0.0, 1.0])
    return _Solid(block.name, bounds + (" INF INF" if d == 2 else ""), angle, block.centre_m, axis)


def surfaces(scenario: Scenario) -> list[str]:
    """Names of all walls and blocks, in the order of the deck."""
    scene = scenario.scene
    return [wall.name for wall in scene.walls] + [block.name for block in scene.blocks]


class _Lines:
    """Numbers as lines of a deck: name, value, unit, meaning and source."""

    def __init__(self, scenario: Scenario, sources: Mapping[str, str]) -> None:
        self.scenario = scenario
        self.sources = sources

    def source(self, key: str) -> str:
        """Where a key's value came from, or the keys below or above it."""
        if key in self.sources:
            return self.sources[key]
        below = {v for k, v in self.sources.items() if k.startswith(key + ".")}
        if below:
            return " and ".join(sorted(below)[:2])
        return self.source(key.rsplit(".", 1)[0]) if "." in key else "default"

    def number(self, name: str, value: float, unit: str, meaning: str, source: str) -> str:
        """One number as a LAMMPS variable that ``-var`` can override."""
        return f"variable {name} index {exact(value)}  # {unit}, {meaning}; {source}"

    def value(self, name: str, key: str) -> str:
        """One key of the scenario as a LAMMPS variable."""
        *path, last = key.split(".")
        section: BaseModel = self.scenario
        for part in path:
            section = getattr(section, part)
        extra = type(section).model_fields[last].json_schema_extra
        unit = str(extra["unit"]) if isinstance(extra, dict) else "1"
        meaning = (type(section).model_fields[last].description or "").rstrip(".")
        return self.number(
            name, getattr(section, last), "-" if unit == "1" else unit, meaning, self.source(key)
        )


def _simulation_box(scenario: Scenario, program: Program) -> list[tuple[float, float]]:
    margin = 2 * scenario.sand.classes(scenario.dimension)[-1].diameter_m
    across = [scenario.box.width_m, scenario.box.depth_m][: scenario.dimension - 1]
    bed = predicted_bed_height_m(scenario, list(program.counts))
    column = max(layer.height_m for layer in program.layers)
    # Half a bed more than predicted: a heap may stand higher than an even bed.
    top = max(1.5 * bed, _obstacle_top_m(scenario)) + scenario.fill.drop_height_m + column + margin
    return [(-margin, size + margin) for size in across] + [(-margin, top)]


def _obstacle_top_m(scenario: Scenario) -> float:
    return max((float(b.corners()[:, -1].max()) for b in scenario.scene.blocks), default=0.0)


def _vibration_key(program: Program, stage: Stage) -> str:
    if not stage.counts_as_vibration:
        return "fill.vibration_between_layers"
    return f"vibration.{[s for s in program.stages if s.counts_as_vibration].index(stage)}"


def render_deck(
    program: Program, sources: Mapping[str, str], run: str = "scene", study: str = "none"
) -> Deck:
    """Render a scenario's deck.

    Parameters
    ----------
    program : Program
    sources : mapping of str to str
        Source of each key's value; shown on the value's line.
    run, study : str
        Names for the deck's first line.
    """
    scenario = program.scenario
    counts = StepCounts.of(scenario)
    lines = _Lines(scenario, sources)
    classes = [_class(scenario, c) for c in scenario.sand.classes(scenario.dimension)]
    masses = np.array([c["mass_kg"] for c in classes])
    planned = np.cumsum([masses[layer.class_number - 1].sum() for layer in program.layers])
    critical = scenario.critical_step
    mean_diameter = sum(c["diameter_m"] * c["count_fraction"] for c in classes)
    text = (
        environment("lammps")
        .get_template("deck.in.j2")
        .render(
            run=run,
            study=study,
            scenario=scenario,
            scene=scenario.scene,
            program=program,
            classes=classes,
            laws={"grain": scenario.contact.grain_grain, "wall": scenario.contact.grain_wall},
            clip=scenario.contact.no_tension == "total",
            damping=scenario.background_damping,
            settling=scenario.fill.settling,
            critical=critical,
            step_s=counts.step_s,
            step_fraction=counts.step_s / critical.step_s,
            skin=0.15 * mean_diameter,
            simulation_box=_simulation_box(scenario, program),
            half_slab=HALF_SLAB_M,
            blocks=[_solid(b) for b in scenario.scene.blocks],
            surfaces=surfaces(scenario),
            obstacle_top=_obstacle_top_m(scenario),
            down="0 -1 0" if scenario.dimension == 2 else "0 0 -1",
            window_steps=counts.window,
            load_steps=counts.load,
            snapshot_steps=counts.windows(scenario.record.snapshot_every_s),
            longest_steps=counts.steps(scenario.fill.settling.longest_s),
            shortest_steps=counts.steps(scenario.fill.settling.shortest_s),
            vibration_steps=counts.vibration,
            vibration_key=lambda stage: _vibration_key(program, stage),
            direction=lambda v: v.unit_direction(scenario.dimension),
            planned_mass=planned.tolist(),
            oldest_version=OLDEST_VERSION,
            source=lines.source,
            number=lines.number,
            value=lines.value,
        )
    )
    return Deck(text)


def _class(scenario: Scenario, c: Any) -> dict[str, float]:
    mass = scenario.sand.grain_mass_kg(c.diameter_m, scenario.dimension)
    factor = 0.5 if scenario.dimension == 2 else 0.4
    return {
        "number": c.number,
        "diameter_m": c.diameter_m,
        "mass_fraction": c.mass_fraction,
        "count_fraction": c.count_fraction,
        "mass_kg": mass,
        "inertia_kg_m2": factor * mass * (c.diameter_m / 2) ** 2,
    }


def layer_data(scenario: Scenario, layer: PlannedLayer, number: int) -> str:
    """Write a layer as a LAMMPS data file; heights count from the layer's lowest point."""
    d = scenario.dimension
    classes = scenario.sand.classes(d)
    upper = [*[scenario.box.width_m, scenario.box.depth_m][: d - 1], layer.height_m]
    bounds = [(0.0, u) for u in upper] + ([(-HALF_SLAB_M, HALF_SLAB_M)] if d == 2 else [])
    head = [
        f"# layer {number}: id, type, diameter (m), density (kg/m3), x, y, z (m); seed"
        f" {scenario.seed}",
        "",
        f"{len(layer.radius_m)} atoms",
        f"{len(classes)} atom types",
        "",
        *(
            f"{exact(lo)} {exact(hi)} {a}lo {a}hi"
            for (lo, hi), a in zip(bounds, "xyz", strict=True)
        ),
        "",
        "Atoms # sphere",
        "",
    ]
    density = exact(scenario.sand.density_kg_m3)
    diameters = [exact(c.diameter_m) for c in classes]
    rows = [
        f"{i} {c} {diameters[c - 1]} {density} " + " ".join(map(repr, p)) + (" 0" if d == 2 else "")
        for i, (c, p) in enumerate(
            zip(layer.class_number.tolist(), layer.position_m.tolist(), strict=True), start=1
        )
    ]
    return "\n".join([*head, *rows]) + "\n"


def write_deck(
    program: Program, sources: Mapping[str, str], folder: Path, run: str, study: str
) -> None:
    """Write ``deck.in`` and ``layers/``; the deck last, so that it stands for all of them."""
    (folder / "layers").mkdir(parents=True, exist_ok=True)
    for number, layer in enumerate(program.layers, start=1):
        path = folder / "layers" / f"layer_{number}.data"
        path.write_text(layer_data(program.scenario, layer, number), encoding="utf-8")
    partial = folder / "deck.in.partial"
    partial.write_text(render_deck(program, sources, run, study).text, encoding="utf-8")
    os.replace(partial, folder / "deck.in")
