"""What the decks of all dialects say in the same words: numbers, sizes, the simulation box."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np
from pydantic import BaseModel

from sandmould.engines.deck import exact, remark
from sandmould.engines.program import Program, Stage
from sandmould.scenario.contact import coarser_than_default
from sandmould.scenario.placement import layer_classes, predicted_bed_height_m
from sandmould.scenario.scenario import Scenario
from sandmould.scenario.stages import StageKind

SKIN = 0.15
"""Neighbour skin of LAMMPS and LIGGGHTS over the mean diameter."""


class Lines:
    """Numbers as lines of a deck: name, value, unit, meaning and source."""

    def __init__(self, scenario: Scenario, sources: Mapping[str, str]) -> None:
        self.scenario = scenario
        self.sources = sources

    def source(self, key: str) -> str:
        """Where a key's value came from, or the keys below or above it: a remark of the deck."""
        if key in self.sources:
            return remark(self.sources[key])
        below = {remark(v) for k, v in self.sources.items() if k.startswith(key + ".")}
        if below:
            return " and ".join(sorted(below)[:2])
        return self.source(key.rsplit(".", 1)[0]) if "." in key else "default"

    def number(self, name: str, value: float, unit: str, meaning: str, source: str) -> str:
        """One number as a variable of the deck that ``-var`` can override."""
        return f"variable {name} index {exact(value)}  # {unit}, {meaning}; {source}"

    def value(self, name: str, key: str) -> str:
        """One key of the scenario, as it is computed with, as a variable of the deck."""
        *path, last = key.split(".")
        section = self._section(path)
        extra = type(section).model_fields[last].json_schema_extra
        unit = str(extra["unit"]) if isinstance(extra, dict) else "1"
        meaning = (type(section).model_fields[last].description or "").rstrip(".")
        value, how = self.in_use(key)
        return self.number(
            name, value, "-" if unit == "1" else unit, f"{meaning}{how}", self.source(key)
        )

    def _section(self, path: list[str]) -> BaseModel:
        section: BaseModel = self.scenario
        for part in path:
            section = getattr(section, part)
        return section

    def in_use(self, key: str) -> tuple[Any, str]:
        """The number that is computed with for a key, and how it follows from the given one."""
        *path, last = key.split(".")
        given = getattr(self._section(path), last)
        sand, contact = self.scenario.sand, self.scenario.contact
        if key == "sand.disc_thickness_m" and given == "grain":
            return sand.thickness_m, ", the median diameter"
        if not key.endswith("_stiffness_n_m"):
            return given, ""
        _, law, spring = key.split(".")
        value = getattr(getattr(self.scenario.laws, law), spring)
        if value == given:
            return value, ""
        if contact.wave_speed_m_s is not None:
            return (
                value,
                f", {given:g} multiplied for a wave speed of {contact.wave_speed_m_s:g} m/s",
            )
        scale = contact.springs_at_size_scale
        coarser = coarser_than_default(sand)
        of_sieve = "" if coarser == 1.0 else f" and {coarser:.4g} of the sieve curve"
        return (
            value,
            f", {given:g} at size_scale {scale:g}, times {sand.size_scale:g}/{scale:g}{of_sieve}",
        )


def simulation_box(scenario: Scenario, program: Program) -> list[tuple[float, float]]:
    """Bounds (m) along each axis, with a margin of two largest grains round the moulding box."""
    margin = 2 * scenario.largest_diameter_m
    across = [scenario.box.width_m, scenario.box.depth_m][: scenario.dimension - 1]
    bed = predicted_bed_height_m(scenario, list(program.counts))
    column = max(layer.height_m for layer in program.layers)
    # Half a bed more than predicted: a heap may stand higher than an even bed, and under a spout
    # far higher.
    heap = 3.0 if scenario.fill.spout is not None else 1.5
    top = max(heap * bed, scenario.scene.top_m) + scenario.fill.drop_height_m + column + margin
    top += max((layer.rise_m(scenario.gravity_m_s2) for layer in program.layers), default=0.0)
    return [(-margin, size + margin) for size in across] + [(-margin, top)]


def skin_m(scenario: Scenario) -> float:
    """Neighbour skin of grains in LAMMPS and LIGGGHTS, and of grains near surfaces."""
    return SKIN * scenario.sand.mean_diameter_m(scenario.dimension)


def vibration_key(program: Program, stage: Stage) -> str:
    """Where in the scenario the vibration of a stage stands, or the one that a rest comes from."""
    if stage.kind in (StageKind.POUR, StageKind.SETTLE):
        return "fill.vibration"
    if stage.kind is StageKind.BETWEEN:
        return "fill.vibration_between_layers"
    if stage.kind is StageKind.REST:
        stage = program.stages[program.stages.index(stage) - 1]
    return f"vibration.{stage.number - 1}"


def size_classes(scenario: Scenario) -> list[dict[str, Any]]:
    """Size classes with the mass and the moment of inertia of a grain."""
    d = scenario.dimension
    rows = []
    for c in scenario.sand.classes(d):
        mass = scenario.sand.grain_mass_kg(c.diameter_m, d)
        inertia = scenario.sand.inertia_factor(d) * mass * (c.diameter_m / 2) ** 2
        rows.append(
            {
                "number": c.number,
                "diameter_m": c.diameter_m,
                "mass_fraction": c.mass_fraction,
                "count_fraction": c.count_fraction,
                "mass_kg": mass,
                "inertia_kg_m2": inertia,
            }
        )
    return rows


def planned_masses_kg(program: Program, classes: list[dict[str, Any]]) -> list[float]:
    """Mass of all grains after each layer."""
    masses = np.array([c["mass_kg"] for c in classes])
    scenario = program.scenario
    each = [
        masses @ np.bincount(layer_classes(scenario, i + 1, count) - 1, minlength=len(masses))
        for i, count in enumerate(program.counts)
    ]
    planned: list[float] = np.cumsum(each).tolist()
    return planned
