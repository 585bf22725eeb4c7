"""A casting that solidifies in its mould: what is poured into what, and how it is computed."""

from __future__ import annotations

from typing import Annotated, Literal

from pydantic import Field, field_validator, model_validator
from pydantic_core import PydanticCustomError

from sandmould.scenario.casting.curves import Curve, curve_fault, fraction_fault, solid_fractions
from sandmould.scenario.casting.shapes import Place, Rectangle, Shape
from sandmould.scenario.quantity import NAME, PLANNED, Section, quantity
from sandmould.scenario.sand import ARGUED

PAPER = "Hirata and Anzai 2019"
OVER_K = " A number, or pairs of a temperature (K) and a value."


def _checked(curve: Curve | None) -> Curve | None:
    """Refuse a curve that is none."""
    if curve is not None and (fault := curve_fault(curve)):
        raise PydanticCustomError("curve", "{fault}", {"fault": fault})
    return curve


class MouldMaterial(Section):
    """What a mould is made of: it conducts and does not melt."""

    name: str = quantity("mould", "What messages call it.", source=ARGUED, min_length=1)
    density_kg_m3: Curve = quantity(..., f"Density.{OVER_K}", unit="kg/m3", source="user")
    heat_capacity_j_kg_k: Curve = quantity(..., f"Heat.{OVER_K}", unit="J/kg/K", source="user")
    conductivity_w_m_k: Curve = quantity(..., f"Conductivity.{OVER_K}", unit="W/m/K", source="user")

    packing: float | None = quantity(
        None,
        "Solid fraction of dry quartz sand, as a study of sand finds it: density and conductivity "
        "are then those of the packing (Zehner and Schluender 1970), not the stated ones.",
        source="user",
        gt=0.4,
        lt=0.8,
    )
    _curves = field_validator("density_kg_m3", "heat_capacity_j_kg_k", "conductivity_w_m_k")(
        _checked
    )


class Metal(MouldMaterial):
    """What is poured: it gives its latent heat between liquidus and solidus."""

    name: str = quantity("casting", "What messages call it.", source=ARGUED, min_length=1)
    latent_heat_j_kg: float = quantity(..., "Latent heat.", unit="J/kg", source="user", ge=0)
    solidus_k: float = quantity(..., "All is solid below it.", unit="K", source="user", gt=0)
    liquidus_k: float = quantity(..., "All is liquid above it.", unit="K", source="user", gt=0)
    solid_fraction: Literal["line", "lever", "scheil"] | tuple[tuple[float, float], ...] = quantity(
        "line",
        "What is solid between solidus and liquidus: a straight line over temperature, the lever "
        "rule, Scheil's law, or pairs of a temperature (K) and a fraction. What the last three "
        "leave liquid at the solidus freezes there.",
        source=ARGUED,
    )
    pure_melts_at_k: float | None = quantity(
        None,
        "Where the pure metal melts, for the lever rule and Scheil's law.",
        unit="K",
        source="user",
        gt=0,
    )
    partition: float | None = quantity(
        None,
        "Solute in the solid over that in the liquid beside it, for the lever rule and Scheil's "
        "law.",
        source="user",
        gt=0,
        lt=1,
    )

    @model_validator(mode="after")
    def _order(self) -> Metal:
        if self.solidus_k > self.liquidus_k:
            raise PydanticCustomError("solidus", "a solidus_k that is not above its liquidus_k")
        if isinstance(self.solid_fraction, tuple):
            fault = fraction_fault(self.solid_fraction, self.solidus_k, self.liquidus_k)
            if fault:
                raise PydanticCustomError(
                    "fraction", "a solid_fraction of {fault}", {"fault": fault}
                )
        elif self.solid_fraction != "line" and not (
            self.partition is not None and self.liquidus_k < (self.pure_melts_at_k or 0.0)
        ):
            raise PydanticCustomError(
                "law", "a partition, and a pure_melts_at_k above liquidus_k, for the law of its "
                "solid_fraction",
            )  # fmt: skip
        return self

    @property
    def solid(self) -> tuple[tuple[float, float], ...]:
        """Temperatures (K) and fractions; none for a straight line."""
        if isinstance(self.solid_fraction, tuple):
            return self.solid_fraction
        return solid_fractions(
            self.solid_fraction, self.solidus_k, self.liquidus_k, self.pure_melts_at_k or 0.0,
            self.partition or 0.0,
        )  # fmt: skip


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
    heat_transfer_w_m2_k: Curve | None = quantity(
        None,
        "Heat that passes from casting to mould, h of eq. (2); perfect contact unless given. A "
        "number, or pairs as heat_transfer_over says.",
        unit="W/m2/K",
        source=ARGUED,
    )
    heat_transfer_over: Literal["temperature", "time"] = quantity(
        "temperature",
        "What the pairs of all heat transfers begin with: the temperature of the hotter surface "
        "(K), or the time since pouring (s).",
        source=ARGUED,
    )
    read_at_solid_fraction: float = quantity(
        0.7,
        "Solid fraction at which gradient, cooling rate and Niyama's value are read, and up to "
        "which metal flows; at least a tenth of the freezing range above the solidus.",
        source=ARGUED,
        gt=0,
        lt=1,
    )
    coating_m2k_w: float = quantity(
        0.0,
        "Resistance of a coating between casting and mould, its thickness over its conductivity: "
        "in series with the heat transfer.",
        unit="m2 K/W",
        source="user",
        ge=0,
    )

    _transfer = field_validator("heat_transfer_w_m2_k")(_checked)


class Insert(MouldMaterial):
    """A chill, core, sleeve or second mould: a body in the mould of another material.

    It fills what the casting leaves free, and of several the last one given has a place.
    """

    shape: Shape = Field(..., description="Its shape; the casting is cut out of it.")
    initial_k: float | None = quantity(
        None, "At the start; that of the mould unless given.", unit="K", source="user", gt=0
    )
    heat_transfer_w_m2_k: Curve | None = quantity(
        None,
        "Heat that passes to it from the casting; as to the mould unless given.",
        unit="W/m2/K",
        source="user",
    )

    _transfer = field_validator("heat_transfer_w_m2_k")(_checked)


Side = Literal["low_x", "high_x", "low_y", "high_y", "low_z", "high_z"]


class Air(Section):
    """Air outside of some sides of the box; the others let no heat pass."""

    sides: tuple[Side, ...] = quantity(..., "Sides that it cools.", source="user", min_length=1)
    temperature_k: float = quantity(..., "Its temperature.", unit="K", source="user", gt=0)
    heat_transfer_w_m2_k: float = quantity(
        ..., "Heat that passes to it.", unit="W/m2/K", source="user", gt=0
    )


class Probe(Section):
    """A point whose temperature is recorded."""

    name: str = quantity(..., "Its column is <name>_k.", source="user", pattern=NAME)
    at_m: Place = quantity(..., "Where it is.", unit="m", source="user")


class Solidification(MetalAndMould):
    """One casting in its mould, complete: an adiabatic box, of 2D or 3D as its corners are."""

    box: Rectangle = Field(
        ..., description="The mould's outside, taken as whole elements; no heat passes but to air."
    )
    shapes: tuple[Shape, ...] = Field(
        ..., min_length=1, description="Parts of the casting; they may touch and overlap."
    )
    risers: tuple[Annotated[int, Field(ge=0)], ...] = quantity(
        (),
        "Which of the shapes are risers, counted from 0: they feed the others, and what they share "
        "with these counts as riser.",
        source="user",
    )
    inserts: tuple[Insert, ...] = Field(
        (), description="Chills, cores, sleeves and other moulds within the mould."
    )
    air: Air | None = Field(None, description="What cools the box from outside.")
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
