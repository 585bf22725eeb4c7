"""Materials that conduct and solidify, and temperature as a function of enthalpy."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from sandmould.arrays import Floats, Ints
from sandmould.compiled import njit


@dataclass(frozen=True)
class ThermalMaterial:
    """Constant properties; between solidus and liquidus the latent heat goes linearly.

    Raises
    ------
    ValueError
        When a property cannot be that of any material.
    """

    name: str
    density_kg_m3: float
    heat_capacity_j_kg_k: float
    conductivity_w_m_k: float
    latent_heat_j_kg: float = 0.0
    solidus_k: float = math.inf
    """Infinite for what does not melt."""
    liquidus_k: float = math.inf

    def __post_init__(self) -> None:
        for key in ("density_kg_m3", "heat_capacity_j_kg_k", "conductivity_w_m_k"):
            value = getattr(self, key)
            if not (value > 0.0 and math.isfinite(value)):
                raise ValueError(f"{self.name}: {key} is {value}; it must be finite and above 0")
        if not (self.latent_heat_j_kg >= 0.0 and math.isfinite(self.latent_heat_j_kg)):
            raise ValueError(
                f"{self.name}: latent_heat_j_kg is {self.latent_heat_j_kg}; it must be finite and "
                "at least 0"
            )
        if not 0.0 < self.solidus_k <= self.liquidus_k:
            raise ValueError(
                f"{self.name}: solidus_k is {self.solidus_k} and liquidus_k {self.liquidus_k}; "
                "the solidus must be above 0 K and not above the liquidus"
            )
        if math.isfinite(self.solidus_k) != math.isfinite(self.liquidus_k):
            raise ValueError(f"{self.name}: it must have both a solidus and a liquidus, or neither")
        if self.latent_heat_j_kg > 0.0 and not self.melts:
            raise ValueError(f"{self.name}: latent heat needs a solidus and a liquidus")

    @property
    def melts(self) -> bool:
        """Whether it has a solidus."""
        return math.isfinite(self.solidus_k)

    @property
    def capacity_j_m3_k(self) -> float:
        """Heat capacity of a volume."""
        return self.density_kg_m3 * self.heat_capacity_j_kg_k


@dataclass(frozen=True)
class EnthalpyTable:
    """Enthalpy of a volume over temperature for each of some materials."""

    reference_k: float
    """Where the enthalpy is 0."""
    rows: Floats
    """(m, 5) float64: J/m3/K; enthalpies of solidus and liquidus, J/m3; solidus and liquidus, K."""

    def enthalpy_j_m3(self, temperature_k: Floats, material: Ints) -> Floats:
        """Enthalpy of elements; one on an isothermal front (solidus = liquidus) is liquid.

        Parameters
        ----------
        temperature_k : (n,) float64, K
        material : (n,) int64

        Returns
        -------
        (n,) float64, J/m3
        """
        capacity, solid, liquid, solidus, liquidus = self.rows[material].T
        below = capacity * (temperature_k - self.reference_k)
        melting = np.isfinite(solidus) & (temperature_k >= solidus)
        liquids = np.isfinite(solidus) & (temperature_k >= liquidus)
        with np.errstate(invalid="ignore", divide="ignore"):
            share = (temperature_k - solidus) / (liquidus - solidus)
            mushy = solid + share * (liquid - solid)
            above = liquid + capacity * (temperature_k - liquidus)
        return np.where(liquids, above, np.where(melting, mushy, below))

    def temperature_k(self, enthalpy_j_m3: Floats, material: Ints) -> Floats:
        """Temperature of elements, (n,) float64, K; the inverse of ``enthalpy_j_m3``."""
        return np.asarray(_temperatures(enthalpy_j_m3, material, self.rows, self.reference_k))


def enthalpy_table(materials: Sequence[ThermalMaterial], reference_k: float) -> EnthalpyTable:
    """Tabulate materials.

    Parameters
    ----------
    materials : sequence of Material
    reference_k : float, K
        Where the enthalpy is 0: the coldest initial temperature, so that drift is counted against
        the heat that is there to be lost.
    """
    rows = []
    for it in materials:
        capacity = it.capacity_j_m3_k
        solid = capacity * (it.solidus_k - reference_k)
        mushy_k = it.liquidus_k - it.solidus_k if it.melts else 0.0
        liquid = solid + capacity * mushy_k + it.density_kg_m3 * it.latent_heat_j_kg
        rows.append((capacity, solid, liquid, it.solidus_k, it.liquidus_k))
    return EnthalpyTable(reference_k, np.array(rows, dtype=np.float64))


@njit(inline="always")
def temperature_of(enthalpy: float, m: int, rows: Any, reference: float) -> Any:
    """Temperature (K) of an enthalpy (J/m3) of material m; compiled code takes it in."""
    if enthalpy < rows[m, 1]:
        return reference + enthalpy / rows[m, 0]
    if enthalpy < rows[m, 2]:
        share = (enthalpy - rows[m, 1]) / (rows[m, 2] - rows[m, 1])
        return rows[m, 3] + share * (rows[m, 4] - rows[m, 3])
    return rows[m, 4] + (enthalpy - rows[m, 2]) / rows[m, 0]


@njit()
def _temperatures(enthalpy: Any, material: Any, rows: Any, reference: float) -> Any:
    temperature = np.empty(len(enthalpy))
    for i in range(len(enthalpy)):
        temperature[i] = temperature_of(enthalpy[i], material[i], rows, reference)
    return temperature
