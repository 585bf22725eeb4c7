"""Flow of metal by particles: what flows in which mould, and how it is computed."""

from __future__ import annotations

from typing import Annotated, Literal

from pydantic import Field

from sandmould.scenario.quantity import PLANNED, Section, quantity
from sandmould.scenario.sand import ARGUED

PAPER = "Hirata and Anzai 2017"
SHOULDER = f"{PAPER}, section 3.1, figure 8"


class PouredMetal(Section):
    """What flows, aluminium unless stated."""

    density_kg_m3: float = quantity(
        2500.0, "Density.", unit="kg/m3", source=f"{PAPER}, table 1", gt=0
    )
    viscosity_m2_s: float = quantity(
        1e-5, "Kinematic viscosity.", unit="m2/s", source=f"{PAPER}, table 1", ge=0
    )


class StillTank(Section):
    """Metal at rest in an open box, in two dimensions; its lower left corner is the origin."""

    kind: Literal["tank"] = Field("tank", description="Case.")
    particle_m: float = quantity(2e-3, "Particle size.", unit="m", source=f"{PAPER}, fig. 2", gt=0)
    width_m: float = quantity(0.04, "Width.", unit="m", source=f"{PAPER}, figure 2", gt=0)
    depth_m: float = quantity(0.08, "Depth of metal.", unit="m", source=f"{PAPER}, fig. 2", gt=0)


class ShoulderedCylinder(Section):
    """The paper's cylinder with a shoulder at half its height, poured from above; its axis is z.

    It is 180 mm high, 40 mm wide below and 25 mm above.
    """

    kind: Literal["shoulder"] = Field(..., description="Case.")
    particle_m: float = quantity(
        5e-3, "Particle size; the paper gives none in space.", unit="m", source=ARGUED, gt=0
    )
    rate_kg_s: float = quantity(
        0.1, "Rate of pouring, until the casting is full.", unit="kg/s", source=SHOULDER, gt=0
    )


class MetalFlow(Section):
    """One flow of metal, complete."""

    case: Annotated[StillTank | ShoulderedCylinder, Field(discriminator="kind")] = Field(
        ..., description="Space that the metal flows in: a tank or a cylinder with a shoulder."
    )
    metal: PouredMetal = Field(
        PouredMetal(), description="Metal that flows: density and viscosity."
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
    collision_distance: float = quantity(
        0.0,
        "Distance over the particle size below which particles that approach each other collide; "
        "0 for none. Metal that is poured needs it.",
        source=PAPER, ge=0, le=1,
    )  # fmt: skip
    duration_s: float = quantity(
        2.0, "Simulated time.", unit="s", source=f"{PAPER}, section 3.1", gt=0
    )
    measured_from_s: float = quantity(
        0.0, "Means and deviations count from here on.", unit="s", source=PAPER, ge=0
    )
    record_s: float = quantity(0.05, "Between records of the field.", unit="s", source=ARGUED, gt=0)
    seed: int = quantity(1, "Nothing is drawn by lot: it changes no result.", source=PLANNED, ge=0)
