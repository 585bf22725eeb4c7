"""A whole scene of sand: what is filled, shaken, recorded, and by which engine."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import replace
from functools import cached_property
from typing import Any, Literal, Self

import numpy as np
from pydantic import Field, model_validator

from sandmould.geometry.geometry import Scene
from sandmould.scenario.box import Box, Obstacle, Piston, Plate, build_scene, piston_wall
from sandmould.scenario.cavities import CavityKey, cavity_space
from sandmould.scenario.contact import BackgroundDamping, Contact, springs_in_use
from sandmould.scenario.engine import Engine
from sandmould.scenario.fill import Discharge, Fill, Rest
from sandmould.scenario.pattern import PatternConfig
from sandmould.scenario.quantity import Section, quantity
from sandmould.scenario.sand import ARGUED, Sand
from sandmould.scenario.stages import StageKind, is_filling
from sandmould.scenario.time_step import BED_FRACTION, CriticalStep, TimeStep, critical_step
from sandmould.scenario.unbalance import Unbalance
from sandmould.scenario.vibration import BoxStage, VibrationStage


class Recording(Section):
    """What a run writes down, and how often; nothing of it changes what is computed."""

    series_every_s: float = quantity(
        0.02,
        "Interval of the time series, rounded to whole checks; loads are means over it.",
        unit="s",
        source=ARGUED,
        gt=0,
        le=100,
    )
    snapshot_every_s: float = quantity(
        0.05, "Interval of snapshots of all grains.", unit="s", source=ARGUED, gt=0, le=100
    )
    orientation: bool = quantity(
        False,
        "Whether snapshots hold the orientation of every grain, eqs. (8)-(13).",
        source=ARGUED,
    )
    checkpoint_every_s: float = quantity(
        0.1,
        "Interval of checkpoints in simulated time, so that a run does not depend on the clock. "
        "On LAMMPS and LIGGGHTS it is rounded to whole times of 20 checks.",
        unit="s",
        source=ARGUED,
        gt=0,
        le=100,
    )


FULL_OVERLAP = 2.0
"""Of the smaller radius: a grain lies wholly in another."""


class GuardLimits(Section):
    """When a run is stopped because its numbers cannot be trusted."""

    largest_overlap_fraction: float = quantity(
        0.5, "Largest overlap over the smaller radius.", source=ARGUED, gt=0, le=FULL_OVERLAP
    )
    wall_limit_s: float | None = quantity(
        None, "Wall time after which the run stops with a checkpoint.", unit="s",
        source="user", gt=0,
    )  # fmt: skip


class Scenario(Section):
    """One scene of sand, complete."""

    dimension: Literal[2, 3] = quantity(2, "Discs (2) or spheres (3).", source=ARGUED)
    gravity_m_s2: float = quantity(
        9.80665, "Gravity, downwards.", unit="m/s2", source="CGPM 1901", ge=0, le=1000
    )
    box: Box = Field(Box(), description="Inner size of the moulding box.")
    obstacles: tuple[Obstacle, ...] = Field(
        (), description="Plates, tubes, polygons, cylinders and meshes in the box."
    )
    cavities: tuple[CavityKey, ...] = Field(
        (), description="Spaces that the sand should fill, of which each is measured by its name."
    )
    pattern: PatternConfig | None = Field(
        None, description="A foam pattern that bends under the sand, coupled with it."
    )
    sand: Sand = Field(Sand(), description="Grains: sieve curve, density, size in the model.")
    contact: Contact = Field(Contact(), description="Contact laws: springs, friction, damping.")
    background_damping: BackgroundDamping = Field(
        BackgroundDamping(), description="Damping of free grains."
    )
    fill: Fill = Field(Fill(), description="How the sand is filled in.")
    piston: Piston | None = Field(
        None, description="A wall of the box that presses on the filled sand; absent unless given."
    )
    discharge: Discharge | None = Field(
        None, description="Flow of the filled sand through an opened gate, before any vibration."
    )
    vibration: tuple[BoxStage, ...] = Field(
        (), description="Stages of vibration and of rest after fill and discharge, in order."
    )
    measure_at_rest: bool = quantity(
        True,
        "true: after the last vibration the box stops, the sand comes to rest, and packing and "
        "fill are measured then. false: the run ends, and is measured, at full speed.",
        source=ARGUED,
    )
    frame: Literal["box", "laboratory"] = quantity(
        "box",
        "Frame of the computation: grains under a body force, eq. (58), or moving walls, eq. (57).",
        source="Rojek 2004, section 3.9",
    )
    engine: Engine = Field(Engine(), description="Engine that computes, and its cores.")
    time_step: TimeStep = Field(TimeStep(), description="Length of the time step.")
    rest: Rest = Field(Rest(), description="When sand is at rest.")
    record: Recording = Field(Recording(), description="What is recorded, and how often.")
    guard: GuardLimits = Field(GuardLimits(), description="When a run is stopped.")
    seed: int = quantity(1, "Seed of all that is drawn.", source="user", ge=0, le=2**31 - 1)

    @model_validator(mode="after")
    def _step_of_bed_where_one_gives_it(self) -> Self:
        """Set the share of the bed's limit where it counts, and nowhere else."""
        taken = self.time_step.bed_fraction
        if self.time_step.step_s is not None or self.pattern is not None:
            taken = None
        elif taken is None and self.vibrations:
            taken = BED_FRACTION
        if taken != self.time_step.bed_fraction:
            # A section never changes once read; this is its reading.
            changed = self.time_step.model_copy(update={"bed_fraction": taken})
            object.__setattr__(self, "time_step", changed)
        return self

    @cached_property
    def scene(self) -> Scene:
        """Geometry of the box, the obstacles and the cavities."""
        scene = build_scene(self.box, self.obstacles, self.dimension)
        spaces = (
            cavity_space(cavity, self.dimension, f"cavities.{i}")
            for i, cavity in enumerate(self.cavities)
        )
        return replace(scene, cavities=tuple(spaces))

    def scene_in(self, stage: str = "") -> Scene:
        """Geometry in a stage, the last where none is named.

        A piston stands where it has gone to once it has moved, from the discharge on there is no
        gate. While it moves it counts as where it is farther out.
        """
        scene, piston = self.scene, self.piston
        if stage and is_filling(stage):
            return scene
        if piston is not None and (piston.way_m < 0.0 or stage != StageKind.PRESS.value):
            scene = scene.with_wall(piston_wall(piston, self.box, self.dimension, piston.way_m))
        if self.discharge is None or stage in (StageKind.PRESS.value, StageKind.HOLD.value):
            return scene
        return scene.without(self.discharge.gate)

    @property
    def vibrations(self) -> tuple[VibrationStage, ...]:
        """The stages in which the box vibrates after fill and discharge."""
        return tuple(stage for stage in self.vibration if isinstance(stage, VibrationStage))

    @property
    def ends_at_rest(self) -> bool:
        """Whether the last that happens is that the sand comes to rest after vibration."""
        rests = self.measure_at_rest or self.vibration[-1:] != self.vibrations[-1:]
        return bool(self.vibrations) and rests

    @property
    def before_vibration(self) -> Scenario:
        """The same scene up to its first vibration: scenes with equal ones share that part."""
        first = next(
            (n for n, s in enumerate(self.vibration) if isinstance(s, VibrationStage)), None
        )
        rests_alone = type(self).model_fields["measure_at_rest"].default
        return self.model_copy(
            update={
                "vibration": self.vibration[:first],
                "measure_at_rest": rests_alone,
                "rest": self.rest.model_copy(update={"shaken_check_every_s": None}),
            }
        )

    @property
    def from_vibration(self) -> Scenario:
        """The scene with the checks and records that it has from its first vibration on."""
        if self.rest.shaken_check_every_s is None:
            return self
        rest = self.rest.while_shaken(self.step_s)
        record = self.record.model_copy(update={"series_every_s": rest.check_every_s})
        return self.model_copy(update={"rest": rest, "record": record})

    @property
    def largest_diameter_m(self) -> float:
        """Diameter of the grains of the largest class."""
        return self.sand.classes(self.dimension)[-1].diameter_m

    @property
    def gate(self) -> Plate | None:
        """The plate that the discharge takes away."""
        plates = (o for o in self.obstacles if isinstance(o, Plate))
        return next((p for p in plates if self.discharge and p.name == self.discharge.gate), None)

    def model_copy(self, *, update: Mapping[str, Any] | None = None, deep: bool = False) -> Self:
        """Copy the scenario with some sections replaced, and the geometry that goes with them."""
        copied = super().model_copy(update=update, deep=deep)
        if update is not None and not {"dimension", "box", "obstacles", "cavities"}.isdisjoint(
            update
        ):
            # pydantic copies cached properties as they are
            copied.__dict__.pop("scene", None)
        return copied

    @property
    def laws(self) -> Contact:
        """Contact laws with the springs that the scene is computed with."""
        return springs_in_use(self.sand, self.contact, self.dimension)

    @property
    def critical_step(self) -> CriticalStep:
        """Critical time step, eqs. (40)-(54)."""
        return critical_step(self.sand, self.laws, self.time_step, self.dimension)

    @property
    def step_s(self) -> float:
        """The time step: the user's own, that of the filled bed, or the planned one."""
        own = self.time_step.step_s
        waits = self.takes_step_of_bed and not self.has_step_of_bed
        return self.planned_step_s if own is None or waits else own

    @property
    def takes_step_of_bed(self) -> bool:
        """Whether the filled bed gives the time step of what follows, or its limit."""
        own = self.time_step.step_s
        above = own is not None and own > self.critical_step.step_s
        return above or bool(self.time_step.bed_fraction)

    @property
    def has_step_of_bed(self) -> bool:
        """Whether the filled bed has done so."""
        return bool(self.time_step.bed_fraction) and self.time_step.step_s is not None

    @property
    def planned_step_s(self) -> float:
        """The asked fraction of the critical time step, which is known before there is a bed."""
        return self.time_step.fraction * self.critical_step.step_s

    def sand_share(self, unbalance: Unbalance) -> float:
        """How often a table feels the force of the grains: in 2D its depth over their thickness."""
        if self.dimension == 3 or unbalance.flask_depth_m is None:
            return 1.0
        return unbalance.flask_depth_m / self.sand.thickness_m

    @property
    def vertical(self) -> int:
        """Index of the vertical axis: the last one."""
        return self.dimension - 1

    @property
    def pouring_m(self) -> tuple[tuple[float, float], ...]:
        """Part of the box that sand is poured over, (low, high) of each horizontal axis, m."""
        x = self.fill.over_x_m or (0.0, self.box.width_m)
        y = self.fill.over_y_m or (0.0, self.box.depth_m)
        return (x, y)[: self.dimension - 1]

    @property
    def pouring_top_m(self) -> float:
        """Height of the highest obstacle that sand is poured over, 0 without any."""
        low, high = np.array(self.pouring_m).T
        tops = [0.0]
        for corners_m in (solid.corners() for solid in self.scene.solids):
            least, most = corners_m[:, :-1].min(axis=0), corners_m[:, :-1].max(axis=0)
            gap = np.maximum(low - most, least - high)
            # A wall beside the part of the box is not under it, its face on the bound included.
            if (gap < -1e-9 * (high - low)).all():
                tops.append(float(corners_m[:, -1].max()))
        return max(tops)

    @property
    def floor_measure(self) -> float:
        """Width (m) in 2D or area (m2) in 3D of the floor that sand is poured over."""
        return math.prod(high - low for low, high in self.pouring_m)
