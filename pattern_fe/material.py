"""The foam of the pattern as an elastic material."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]


@dataclass(frozen=True)
class Foam:
    """An isotropic elastic material, by default the polystyrene of Rojek (2004), section 4.3.

    Raises
    ------
    ValueError
        When a modulus or density is not positive, or Poisson's ratio is not inside (-1, 0.5).
    """

    young_pa: float = 6.4e6
    poisson: float = 0.35
    density_kg_m3: float = 12.0

    def __post_init__(self) -> None:
        for name, value, unit in (
            ("Young's modulus", self.young_pa, "Pa"),
            ("density", self.density_kg_m3, "kg/m3"),
        ):
            if not (math.isfinite(value) and value > 0.0):
                raise ValueError(f"{name} of the pattern is {value:g} {unit}, valid is above 0")
        if not -1.0 < self.poisson < 0.5:
            valid = "valid is above -1 and below 0.5 (at 0.5 the volume cannot change)"
            raise ValueError(f"Poisson's ratio of the pattern is {self.poisson:g}, {valid}")

    @property
    def lame_pa(self) -> tuple[float, float]:
        """Lamé's lambda and mu, Pa."""
        shear = self.young_pa / (2.0 * (1.0 + self.poisson))
        return 2.0 * shear * self.poisson / (1.0 - 2.0 * self.poisson), shear

    def stress_pa(self, strain: Array) -> Array:
        """Hooke's law in 3D or plane strain, for Green strains that of St. Venant and Kirchhoff.

        Gives (..., d, d) float64, Pa; in plane strain the stress across the plane is not among
        them. ``strain``: (..., d, d) float64.
        """
        lam, mu = self.lame_pa
        volume = np.trace(strain, axis1=-2, axis2=-1)[..., None, None]
        return np.asarray(lam * volume * np.eye(strain.shape[-1]) + 2.0 * mu * strain)
