"""A casting that solidifies in its mould: what is poured into what, and how it is computed."""

from __future__ import annotations

from typing import Annotated, Literal

from pydantic import Field, model_validator
from pydantic_core import PydanticCustomError

from sandmould.scenario.casting.shapes import Place, Rectangle, Shape
from sandmould.scenario.quantity import NAME, PLANNED, Section, quantity
from sandmould.scenario.sand import ARGUED

PAPER = "Hirata and Anzai 2019"


class MouldMaterial(Section):
    """What a mould is made of: it conducts and does not melt."""

    name: str = quantity("mould", "What messages call it.", source=ARGUED, min_length=1)
    density_kg_m3: float = quantity(..., "Density.", unit="kg/m3", source="user", gt=0)
    heat_capacity_j_kg_k: float = quantity(..., "Heat.", unit="J/kg/K", source="user", gt=0)
    conductivity_w_m_k: float = quantity(..., "Conductivity.", unit="W/m/K", source="user", gt=0)


class Metal(MouldMaterial):
    """What is poured: it gives its latent heat evenly between liquidus and solidus."""

    name: str = quantity("casting", "What messages call it.", source=ARGUED, min_length=1)
    latent_heat_j_kg: float = quantity(..., "Latent heat.", unit="J/kg", source="user", ge=0)
    solidus_k: float = quantity(..., "All is solid below it.", unit="K", source="user", gt=0)
    liquidus_k: float = quantity(..., "All is liquid above it.", unit="K", source="user", gt=0)

    @model_validator(mode="after")
    def _order(self) -> Metal:
        if self.solidus_k > self.liquidus_k:
            raise PydanticCustomError("solidus", "a solidus_k that is not above its liquidus_k")
        return self


class PouredAt(Section):
    """Temperatures when the mould is full."""

    casting: float = quantity(..., "Of the casting.", unit="K", source="user", gt=0)
    mould: float = quantity(..., "Of the mould.", unit="K", source="user", gt=0)


class MetalAndMould(Section):
    """A named pair of materials: the part of a scenario that a material file may state."""

    casting: Metal = Field(
        ..., description="Metal of the casting, with the temperatures at which it freezes."
    )
    mould: MouldMaterial = Field(
        ..., description="Sand or die round the casting, which takes its heat."
    )
    initial_k: PouredAt = Field(..., description="Temperatures at the start.")
    heat_transfer_w_m2_k: float | None = quantity(
        None,
        "Heat that passes from casting to mould, h of eq. (2); perfect contact unless given.",
        unit="W/m2/K",
        source=ARGUED,
        gt=0,
    )


class Probe(Section):
    """A point whose temperature is recorded."""

    name: str = quantity(..., "Its column is <name>_k.", source="user", pattern=NAME)
    at_m: Place = quantity(..., "Where it is.", unit="m", source="user")


class Solidification(MetalAndMould):
    """One casting in its mould, complete: an adiabatic box, of 2D or 3D as its corners are."""

    box: Rectangle = Field(..., description="The mould's outside; no heat passes it.")
    shapes: tuple[Shape, ...] = Field(
        ..., min_length=1, description="Parts of the casting; none may overlap another."
    )
    probes: tuple[Probe, ...] = Field((), description="Points of cooling curves.")
    element_m: float = quantity(..., "Side of the smallest element.", unit="m", source="user", gt=0)
    layers: tuple[Annotated[int, Field(ge=0, le=1000)], ...] = quantity(
        (),
        "For each doubling of the elements' size, how many layers of the smaller size stay beside "
        "the interface; empty for elements of one size.",
        source=f"{PAPER}, section 4.1",
        max_length=8,
    )
    exchange: Literal["printed", "corrected", "symmetric", "faces", "difference"] = quantity(
        "faces",
        "How elements exchange heat: three readings of eqs. (4) and (5), true faces, or finite "
        "differences.",
        source=ARGUED,
    )
    kernel_size: float = quantity(
        2.1, "c_k of eq. (3); of no use to faces and differences.", source=PAPER, gt=1, le=10
    )
    threads: int = quantity(1, "Threads of one run.", source=ARGUED, ge=1, le=256)
    record_s: float = quantity(5.0, "Between records.", unit="s", source=ARGUED, gt=0)
    until_s: float = quantity(
        20000.0, "The run ends here if something is still liquid.", unit="s", source=ARGUED, gt=0
    )
    hot_spot_reach_m: float = quantity(
        0.02,
        "A hot spot freezes later than all of the casting within this distance.",
        unit="m",
        source=ARGUED,
        gt=0,
    )
    seed: int = quantity(1, "Nothing is drawn by lot: it changes no result.", source=PLANNED, ge=0)

    @property
    def dimensions(self) -> int:
        """2 or 3."""
        return len(self.box.low_m)
