"""Materials that conduct and solidify, and temperature as a function of enthalpy.

Properties are numbers or curves over temperature. Elements keep their volume: a density that falls
with temperature counts as heat that a volume holds, not as metal that leaves it.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from sandmould.arrays import Floats, Ints
from sandmould.compiled import njit
from sandmould.scenario.casting.curves import (
    QUARTZ_KG_M3,
    Curve,
    along,
    curve_fault,
    ends,
    packed_w_m_k,
)
from sandmould.scenario.casting.solidification import Metal, MouldMaterial

PROPERTIES = ("density_kg_m3", "heat_capacity_j_kg_k", "conductivity_w_m_k")
NODES = 1024
"""Of a table of temperature over enthalpy: a node each two kelvin or so."""
READ_AT = 0.7
"""Solid fraction at which gradient and cooling rate are read, unless another is stated."""
HEAD = 6
"""Numbers of a material before those of its curves."""
LAST_SHARE = 0.1
"""Of the freezing range, above the solidus, below which nothing is read: what is left at the
solidus freezes without cooling. Carlson and Beckermann (2009) read there, as remembered."""


@dataclass(frozen=True)
class ThermalMaterial:
    """What conducts heat, and may freeze.

    Raises
    ------
    ValueError
        When a property cannot be that of any material.
    """

    name: str
    density_kg_m3: Curve
    heat_capacity_j_kg_k: Curve
    conductivity_w_m_k: Curve
    latent_heat_j_kg: float = 0.0
    solidus_k: float = math.inf
    """Infinite for what does not melt."""
    liquidus_k: float = math.inf
    solid_fraction: tuple[tuple[float, float], ...] = ()
    """Temperatures (K) from solidus to liquidus and what is solid at each; what is liquid at the
    solidus freezes there. Empty for a straight line."""

    def __post_init__(self) -> None:
        for key in PROPERTIES:
            if fault := curve_fault(getattr(self, key)):
                raise ValueError(f"{self.name}: {key} is {getattr(self, key)}; valid is {fault}")
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

    def read_k(self, solid_fraction: float) -> float:
        """Where gradients are read, K; NaN for what does not freeze over a range."""
        range_k = self.liquidus_k - self.solidus_k
        if not (self.melts and range_k > 0.0):
            return math.nan
        over_k = np.linspace(self.liquidus_k, self.solidus_k + LAST_SHARE * range_k, NODES)
        return float(np.interp(solid_fraction, self.solid(over_k), over_k))

    @property
    def is_plain(self) -> bool:
        """Whether heat is a straight line over temperature but for a straight freezing range."""
        of_heat = (self.density_kg_m3, self.heat_capacity_j_kg_k)
        return not (self.solid_fraction or any(isinstance(curve, tuple) for curve in of_heat))

    @property
    def capacity_j_m3_k(self) -> float:
        """Least heat capacity of a volume, without latent heat: it limits the steps."""
        return float(self.capacities_j_m3_k(self.corners_k(0.0, 1.0)).min())

    def capacities_j_m3_k(self, temperature_k: Floats) -> Floats:
        """Heat capacity of a volume at temperatures, (n,) float64, J/m3/K."""
        density = along(self.density_kg_m3, temperature_k)
        return density * along(self.heat_capacity_j_kg_k, temperature_k)

    def corners_k(self, low_k: float, high_k: float) -> Floats:
        """Two temperatures and all between which properties are not straight, (n,) float64, K."""
        curves = [getattr(self, key) for key in PROPERTIES] + [self.solid_fraction]
        bends = [t for curve in curves if isinstance(curve, tuple) for t, _ in curve]
        return np.unique([low_k, high_k, *bends])

    def solid(self, temperature_k: Floats) -> Floats:
        """What is solid between solidus and liquidus, (n,) float64."""
        line = ((self.solidus_k, 1.0), (self.liquidus_k, 0.0))
        return along(self.solid_fraction or line, temperature_k)


def thermal(it: MouldMaterial) -> ThermalMaterial:
    """A material as the solver takes it."""
    density, conductivity = it.density_kg_m3, it.conductivity_w_m_k
    if it.packing is not None:
        density, conductivity = it.packing * QUARTZ_KG_M3, packed_w_m_k(it.packing)
    plain = ThermalMaterial(it.name, density, it.heat_capacity_j_kg_k, conductivity)
    if not isinstance(it, Metal):
        return plain
    return replace(
        plain, latent_heat_j_kg=it.latent_heat_j_kg, solidus_k=it.solidus_k,
        liquidus_k=it.liquidus_k, solid_fraction=it.solid,
    )  # fmt: skip


@dataclass(frozen=True)
class EnthalpyTable:
    """Enthalpy of a volume over temperature for each of some materials."""

    reference_k: float
    """Where the enthalpy is 0."""
    rows: Floats
    """(m, 6) float64: J/m3/K; enthalpies of solidus and liquidus, J/m3; solidus and liquidus, K;
    enthalpy at which gradients are read, J/m3. Where a material has curves all rows go on: number
    of the node at no enthalpy, nodes for a J/m3; of the straight line that begins at each node the
    temperature at no enthalpy, K, and the slope, K m3/J, side by side."""

    def enthalpy_j_m3(self, temperature_k: Floats, material: Ints) -> Floats:
        """Enthalpy of elements; one on an isothermal front (solidus = liquidus) is liquid.

        Gives (n,) float64, J/m3. ``temperature_k``: (n,) float64, K; ``material``: (n,) int64.
        """
        if self.rows.shape[1] > HEAD:
            found = np.empty(len(temperature_k))
            for m in np.unique(material):
                own, (shift, density) = material == m, self.rows[m, HEAD : HEAD + 2]
                heat = (np.arange(NODES) - shift) / density
                at_0_k, slope = self.rows[m, HEAD + 2 :].reshape(NODES, 2).T
                found[own] = np.interp(temperature_k[own], at_0_k + slope * heat, heat)
            return found
        capacity, solid, liquid, solidus, liquidus = self.rows[material, :5].T
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


def enthalpy_table(
    materials: Sequence[ThermalMaterial],
    reference_k: float,
    hottest_k: float = 0.0,
    read_at: float = READ_AT,
) -> EnthalpyTable:
    """Tabulate materials.

    ``reference_k``: where the enthalpy is 0: the coldest initial temperature, so that drift is
    counted against the heat that is there to be lost. ``hottest_k``: to where curves are tabulated.
    ``read_at``: solid fraction at which gradients are read.
    """
    plain = all(it.is_plain for it in materials)
    hottest_k = max([hottest_k, *(it.liquidus_k for it in materials if it.melts)])
    rows = [
        _line(it, reference_k) if plain else _curves(it, reference_k, hottest_k) for it in materials
    ]
    table = EnthalpyTable(reference_k, np.array(rows))
    read_k = np.array([it.read_k(read_at) for it in materials])
    table.rows[:, 5] = table.enthalpy_j_m3(read_k, np.arange(len(materials)))
    return table


def _line(it: ThermalMaterial, reference_k: float) -> tuple[float, ...]:
    capacity = it.capacity_j_m3_k
    solid = capacity * (it.solidus_k - reference_k)
    mushy_k = it.liquidus_k - it.solidus_k if it.melts else 0.0
    density = ends(it.density_kg_m3)[0]
    liquid = solid + capacity * mushy_k + density * it.latent_heat_j_kg
    return capacity, solid, liquid, it.solidus_k, it.liquidus_k, math.nan


def _integral(values: Floats, over: Floats) -> Floats:
    """Integral from the first of some places to each, of straight lines between them."""
    parts = 0.5 * (values[1:] + values[:-1]) * np.diff(over)
    return np.concatenate([[0.0], np.cumsum(parts)])


def _curves(it: ThermalMaterial, reference_k: float, hottest_k: float) -> Floats:
    """Row of a material with curves."""
    beyond = 0.1 * max(hottest_k - reference_k, 10.0)
    low_k, high_k = max(reference_k - beyond, 1.0), hottest_k + beyond
    place = np.union1d(it.corners_k(low_k, high_k), np.linspace(low_k, high_k, NODES))
    place = place[(place >= low_k) & (place <= high_k)]
    solid = np.ones(len(place))
    if it.melts:
        # at the solidus twice: what is left freezes there
        place = np.sort(np.append(place[place != it.solidus_k], [it.solidus_k] * 2))
        solid = np.where(place > it.solidus_k, it.solid(place), 1.0)
        solid[np.searchsorted(place, it.solidus_k) + 1] = it.solid(np.array([it.solidus_k]))[0]
        if it.solidus_k == it.liquidus_k:
            solid[place > it.solidus_k] = 0.0
            solid[np.searchsorted(place, it.solidus_k) + 1] = 0.0
    heat = _integral(it.capacities_j_m3_k(place), place)
    melted_kg_m3 = _integral(along(it.density_kg_m3, place), 1.0 - solid)
    heat += it.latent_heat_j_kg * melted_kg_m3
    heat -= np.interp(reference_k, place, heat)
    solidus, liquidus = math.inf, math.inf
    if it.melts:
        solidus = heat[np.searchsorted(place, it.solidus_k)]
        liquidus = heat[np.searchsorted(place, it.liquidus_k, side="right") - 1]
    least = it.capacities_j_m3_k(place).min()
    nodes = np.linspace(heat[0], heat[-1], NODES)
    per_node = (NODES - 1) / (heat[-1] - heat[0])
    node_k = np.interp(nodes, heat, place)
    slope = np.diff(node_k, append=node_k[-1]) * per_node
    slope[-1] = slope[-2]
    head = [least, solidus, liquidus, it.solidus_k, it.liquidus_k, math.nan]
    numbers = [-heat[0] * per_node, per_node]
    lines = np.stack([node_k - slope * nodes, slope], axis=1)
    return np.concatenate([head, numbers, lines.reshape(-1)])


@njit(inline="always")
def temperature_of(enthalpy: float, m: int, rows: Any, reference: float) -> Any:
    """Temperature (K) of an enthalpy (J/m3) of material m; compiled code takes it in."""
    if rows.shape[1] > HEAD:
        # whole numbers are bounded in less time
        node = min(max(int(enthalpy * rows[m, HEAD + 1] + rows[m, HEAD]), 0), NODES - 2)
        at = HEAD + 2 + 2 * node
        return rows[m, at] + rows[m, at + 1] * enthalpy
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
