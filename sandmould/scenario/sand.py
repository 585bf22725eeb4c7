"""The sand: density, sieve curve and the size classes that stand for it."""

from __future__ import annotations

import math
from dataclasses import dataclass
from functools import lru_cache
from itertools import pairwise
from typing import Annotated, Literal

import numpy as np
from pydantic import Field, model_validator
from pydantic_core import PydanticCustomError

from sandmould.scenario.quantity import Section, quantity
from sandmould.sums import added

PAPER = "Rojek 2004, section 4.1"
ARGUED = "argued default, docs/choices.md"


class SievePoint(Section):
    """One sieve: the share of the sand's mass that passes its opening."""

    opening_m: float = quantity(..., "Sieve opening.", unit="m", source="user", ge=1e-6, le=0.1)
    passing_fraction: float = quantity(
        ..., "Mass fraction finer than the opening.", source="user", ge=0, le=1
    )


DEFAULT_SIEVE = tuple(
    SievePoint(opening_m=opening, passing_fraction=passing)
    for opening, passing in (
        (0.25e-3, 0.0),
        (0.355e-3, 0.10),
        (0.5e-3, 0.38),
        (0.71e-3, 0.74),
        (1.0e-3, 0.96),
        (1.125e-3, 1.0),
    )
)


@dataclass(frozen=True)
class SizeClass:
    """Grains of one diameter; an engine gives each class its own atom type."""

    number: int
    diameter_m: float
    mass_fraction: float
    count_fraction: float


class Sand(Section):
    """Grains: material density, sizes and, in 2D, the thickness of the discs."""

    density_kg_m3: float = quantity(
        2400.0, "Density of the grains' material.", unit="kg/m3", source=PAPER, ge=1, le=30000
    )
    sieve: tuple[SievePoint, ...] = Field(
        DEFAULT_SIEVE,
        min_length=2,
        description="Sieve curve of the real sand, finest opening first, from 0 to 1.",
        json_schema_extra={"unit": "m, 1", "source": ARGUED},
    )
    size_scale: float = quantity(
        4.0, "Size of a modelled grain over a real one.", source=PAPER, ge=0.01, le=100
    )
    size_classes: int = quantity(
        5, "Number of diameters that stand for the sieve curve.", source=ARGUED, ge=1, le=20
    )
    disc_thickness_m: Annotated[float, Field(ge=1e-6, le=10)] | Literal["grain"] = quantity(
        "grain",
        "Length of a disc across the plane, 2D only; grain is the median diameter by mass, which "
        "makes discs as hard under their load as spheres are.",
        unit="m",
        source=ARGUED,
    )
    disc_inertia: Literal["disc", "sphere"] = quantity(
        "disc", "Whose moment of inertia a disc has, 1/2 m r^2 or 2/5 m r^2, 2D only.",
        source="Rojek 2004, section 3.1",
    )  # fmt: skip

    @model_validator(mode="after")
    def _curve_rises(self) -> Sand:
        for a, b in pairwise(self.sieve):
            if b.opening_m <= a.opening_m * (1 + 1e-9) or b.passing_fraction < a.passing_fraction:
                raise PydanticCustomError("sieve", "a sieve curve that rises, finest opening first")
        if self.sieve[0].passing_fraction != 0 or self.sieve[-1].passing_fraction != 1:
            raise PydanticCustomError("sieve", "a sieve curve from passing 0 to passing 1")
        return self

    @lru_cache(maxsize=1000)  # noqa: B019  a sand is small, and asked for its classes all the time
    def classes(self, dimension: int) -> tuple[SizeClass, ...]:
        """Split the sieve curve into classes of equal width in log diameter.

        A class stands at the geometric mean of its bounds and keeps its share of the mass, so in
        2D the mass of discs (as r^2) follows the curve. Empty classes are dropped.
        """
        opening = np.log([p.opening_m * self.size_scale for p in self.sieve])
        passing = np.array([p.passing_fraction for p in self.sieve])
        edges = np.linspace(opening[0], opening[-1], self.size_classes + 1)
        mass = np.diff(np.interp(edges, opening, passing)).round(12)
        # Logarithms differ in their last digit between processors; decks must not.
        diameter = np.array([float(f"{d:.12g}") for d in np.exp((edges[1:] + edges[:-1]) / 2)])
        keep = mass > 0
        mass, diameter = mass[keep], diameter[keep]
        count = mass / diameter**dimension
        count /= count.sum()
        return tuple(
            SizeClass(i + 1, float(d), float(m), float(c))
            for i, (d, m, c) in enumerate(zip(diameter, mass, count, strict=True))
        )

    @property
    def mass_median_diameter_m(self) -> float:
        """Diameter that half of the modelled sand's mass is finer than."""
        return self.real_median_m * self.size_scale

    @property
    def real_median_m(self) -> float:
        """The same of the real sand.

        Read off the sieve curve, which is taken as straight between openings.
        """
        passing = [p.passing_fraction for p in self.sieve]
        opening_m = [p.opening_m for p in self.sieve]
        return float(np.interp(0.5, passing, opening_m))

    def mean_diameter_m(self, dimension: int) -> float:
        """Mean diameter of the modelled grains by number."""
        return added(c.diameter_m * c.count_fraction for c in self.classes(dimension))

    @property
    def thickness_m(self) -> float:
        """Length of a disc across the plane as a number."""
        given = self.disc_thickness_m
        return self.mass_median_diameter_m if given == "grain" else given

    def grain_measure(self, diameter_m: float, dimension: int) -> float:
        """Area (m2) of a disc or volume (m3) of a sphere."""
        return math.pi / 4 * diameter_m**2 if dimension == 2 else math.pi / 6 * diameter_m**3

    def inertia_factor(self, dimension: int) -> float:
        """Moment of inertia of a grain over m r^2."""
        return 0.5 if dimension == 2 and self.disc_inertia == "disc" else 0.4

    def grain_mass_kg(self, diameter_m: float, dimension: int) -> float:
        """Mass of a grain: rho pi r^2 b for a disc, rho 4/3 pi r^3 for a sphere."""
        thickness = self.thickness_m if dimension == 2 else 1.0
        return self.density_kg_m3 * thickness * self.grain_measure(diameter_m, dimension)
