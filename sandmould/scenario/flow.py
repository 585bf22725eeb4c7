"""Flow of metal by particles: what flows in which mould, and how it is computed."""

from __future__ import annotations

from typing import Annotated, Literal

from pydantic import Field, model_validator
from pydantic_core import PydanticCustomError

from sandmould.scenario.quantity import NAME, Section, quantity
from sandmould.scenario.sand import ARGUED

PAPER = "Hirata and Anzai 2017"
SHOULDER = f"{PAPER}, section 3.1, figure 8"


class PouredMetal(Section):
    """What flows."""

    name: str = quantity("pure aluminium", "What it is.", source=f"{PAPER}, table 1", min_length=1)
    density_kg_m3: float = quantity(
        2500.0, "Density.", unit="kg/m3", source=f"{PAPER}, table 1", gt=0
    )
    viscosity_m2_s: float = quantity(
        1e-5, "Kinematic viscosity.", unit="m2/s", source=f"{PAPER}, table 1", ge=0
    )
    gravity_m_s2: float = quantity(
        9.8,
        "Gravity, downwards.",
        unit="m/s2",
        source=f"{PAPER}: 1960 Pa under 80 mm",
        gt=0,
    )


class StillTank(Section):
    """Metal at rest in an open box, in two dimensions; its lower left corner is the origin."""

    kind: Literal["tank"] = Field("tank", description="Case.")
    particle_m: float = quantity(2e-3, "Particle size.", unit="m", source=f"{PAPER}, fig. 2", gt=0)
    width_m: float = quantity(0.04, "Width.", unit="m", source=f"{PAPER}, figure 2", gt=0)
    depth_m: float = quantity(0.08, "Depth of metal.", unit="m", source=f"{PAPER}, fig. 2", gt=0)


class ShoulderedCylinder(Section):
    """A cylinder with a shoulder at half its height, poured from above; its axis is z."""

    kind: Literal["shoulder"] = Field(..., description="Case.")
    particle_m: float = quantity(
        5e-3, "Particle size; the paper gives none in space.", unit="m", source=ARGUED, gt=0
    )
    height_m: float = quantity(0.18, "Height of the casting.", unit="m", source=SHOULDER, gt=0)
    lower_m: float = quantity(0.04, "Diameter of the lower half.", unit="m", source=SHOULDER, gt=0)
    upper_m: float = quantity(0.025, "Diameter of the upper half.", unit="m", source=SHOULDER, gt=0)
    starts: Literal["empty", "full"] = quantity(
        "empty", "Whether it is poured or stands full of metal at rest.", source=SHOULDER
    )
    rate_kg_s: float = quantity(
        0.1, "Rate of pouring, until the casting is full.", unit="kg/s", source=SHOULDER, gt=0
    )

    @model_validator(mode="after")
    def _shoulder(self) -> ShoulderedCylinder:
        if self.upper_m > self.lower_m:
            raise PydanticCustomError("shoulder", "an upper_m that is not above its lower_m")
        return self


class PressureProbe(Section):
    """A place whose pressure is recorded."""

    name: str = quantity(..., "Its column is <name>_pa.", source="user", pattern=NAME)
    at_m: tuple[float, float] = quantity(
        ...,
        "In a tank: x and height. In a cylinder: distance from the axis and height; the mean of "
        "eight places round the axis counts.",
        unit="m",
        source="user",
    )


class MetalFlow(Section):
    """One flow of metal, complete."""

    case: Annotated[StillTank | ShoulderedCylinder, Field(discriminator="kind")] = Field(
        ..., description="Space that the metal flows in: a tank or a cylinder with a shoulder."
    )
    metal: PouredMetal = Field(
        PouredMetal(), description="Metal that flows: density, viscosity, gravity."
    )
    dt_max_s: float = quantity(
        1e-3, "Largest time step.", unit="s", source=f"{PAPER}, table 2", gt=0
    )
    relaxations: int = quantity(
        5,
        "Times the pressure is solved for and positions are corrected in a step; 1 is plain MPS.",
        source=f"{PAPER}, table 2",
        ge=1,
        le=100,
    )
    source_share: float = quantity(
        0.5,
        "c_poi: of the source of the Poisson equation that one relaxation undoes.",
        source=f"{PAPER}, table 2",
        gt=0,
        le=1,
    )
    source: Literal[
        "density", "divergence", "corrected_divergence", "higher_order", "error_compensating"
    ] = quantity(
        "density",
        "Source of the Poisson equation; the paper's is density. corrected_divergence is exact "
        "off the lattice, for flow without a free surface. Nothing but shifting keeps the volume "
        "then.",
        source=PAPER,
    )
    gradient: Literal["least", "difference", "sum", "corrected", "printed"] = quantity(
        "least",
        "Pressure gradient: against the least pressure around, which only repels, or another form.",
        source=ARGUED,
    )
    laplacian: Literal["lattice", "fitted"] = quantity(
        "lattice",
        "Laplacian of the velocity: eq. (4), or a fit that is exact off the lattice.",
        source=PAPER,
    )
    surface: float = quantity(
        0.985,
        "beta of eq. (7): number density below which a particle is at the surface.",
        source=PAPER,
        ge=0.8,
        le=1,
    )
    courant: float = quantity(0.1, "C_n of eq. (8).", source=PAPER, gt=0, le=1)
    tolerance: float = quantity(
        3e-3, "Of the Poisson equation: residual over source.", source=ARGUED, gt=0, lt=1
    )
    tension: bool = quantity(
        False, "Whether pressures below zero, which pull particles together, are kept.",
        source=ARGUED,
    )  # fmt: skip
    shifting: float = quantity(
        0.0,
        "Share of r0^2 by which inner particles move on to where fewer are; 0 for none. They take "
        "the velocity found there.",
        source=ARGUED, ge=0, le=0.5,
    )  # fmt: skip
    collision_distance: float = quantity(
        0.0,
        "Distance over the particle size below which particles that approach each other collide; "
        "0 for none. Metal that is poured needs it.",
        source=PAPER, ge=0, le=1,
    )  # fmt: skip
    restitution: float = quantity(0.2, "Of these collisions.", source=ARGUED, ge=0, le=1)
    duration_s: float = quantity(
        2.0, "Simulated time.", unit="s", source=f"{PAPER}, section 3.1", gt=0
    )
    measured_from_s: float = quantity(
        0.0, "Means and deviations count from here on.", unit="s", source=PAPER, ge=0
    )
    record_s: float = quantity(0.05, "Between records of the field.", unit="s", source=ARGUED, gt=0)
    quiet_pa: float = quantity(
        200.0,
        "Standard deviation of the deepest probe's pressure below which a run is excellent.",
        unit="Pa",
        source=f"{PAPER}, section 3.1",
        gt=0,
    )
    noise_window_s: float = quantity(
        0.01,
        "A second deviation is taken of means over windows of this length. With c_poi = 1 fluid "
        "is thrown up in one step and falls in the next.",
        unit="s",
        source=ARGUED,
        gt=0,
    )
    probes: tuple[PressureProbe, ...] = Field(
        (),
        description="Where pressure is recorded. Unless given, at the places of the paper: in a "
        "tank at 3/8, 5/8 and 7/8 of its depth; in a cylinder at its bottom and under its "
        "shoulder.",
    )
    seed: int = quantity(1, "Nothing is drawn by lot: it changes no result.", source=ARGUED, ge=0)
