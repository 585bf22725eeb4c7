"""Which materials fill a box at time 0, and what is refused."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass, field
from itertools import combinations

import numpy as np

from sandmould.arrays import Flags, Floats
from sandmould.casting.arpm.elements import Elements
from sandmould.casting.arpm.exchange import resistances
from sandmould.casting.arpm.marching import Heat, Substance
from sandmould.casting.arpm.material import READ_AT, EnthalpyTable, ThermalMaterial, enthalpy_table
from sandmould.casting.arpm.varying import Curves, Transfer
from sandmould.scenario.casting.curves import ends

OUTSIDE = 0.05
"""Of the range of initial temperatures: farther out no stable step leads."""


@dataclass(frozen=True)
class Filling:
    """Materials by number, hot or cold, with a resistance where two of them meet.

    Raises
    ------
    ValueError
        When the lists differ in length or a temperature is not above 0 K.
    """

    materials: tuple[ThermalMaterial, ...]
    """The first is the mould."""
    initial_k: tuple[float, ...]
    resistance_m2k_w: float = 0.0
    """1/h of eq. (2): between the casting and every other material."""
    transfers: Mapping[tuple[int, int], Transfer] = field(default_factory=dict)
    """Of two materials, the smaller number first, where another one acts."""
    read_at: float = READ_AT
    """Solid fraction at which gradients are read."""

    def __post_init__(self) -> None:
        if len(self.initial_k) != len(self.materials) or not self.materials:
            raise ValueError(
                f"{len(self.materials)} materials have {len(self.initial_k)} initial "
                "temperatures; each needs one"
            )
        if not all(0.0 < t < math.inf for t in self.initial_k):
            raise ValueError(f"initial_k is {self.initial_k}; all must be finite and above 0")

    @property
    def conductivity_w_m_k(self) -> Floats:
        """Largest of each material, (m,) float64, W/m/K."""
        return np.array([ends(it.conductivity_w_m_k)[1] for it in self.materials])

    @property
    def least_m2k_w(self) -> Floats:
        """Least resistance between each two materials, (m, m) float64, m2 K/W."""
        found = resistances(self.resistance_m2k_w, len(self.materials))
        for pair, transfer in self.transfers.items():
            found[pair] = found[pair[::-1]] = transfer.least_m2k_w
        return found

    @property
    def curves(self) -> Curves | None:
        """What conductances follow; None where they are always the same."""
        if not any(isinstance(it.conductivity_w_m_k, tuple) for it in self.materials) and not any(
            it.varies for it in self.transfers.values()
        ):
            return None
        least = self.least_m2k_w
        transfers = {
            (i, j): self.transfers.get((i, j), Transfer(1.0 / least[i, j] if least[i, j] else None))
            for i, j in combinations(range(len(least)), 2)
        }
        low_k, high_k = min(self.initial_k), max(self.initial_k)
        beyond_k = OUTSIDE * (high_k - low_k) + 1.0
        return Curves(self.materials, transfers, low_k - beyond_k, high_k + beyond_k)

    @property
    def table(self) -> EnthalpyTable:
        """Enthalpy counted from the coldest initial temperature: heat that can be lost."""
        return enthalpy_table(
            self.materials, min(self.initial_k), max(self.initial_k), self.read_at
        )

    def melts(self, elements: Elements) -> Flags:
        """Which elements solidify, (n,) bool."""
        return np.array([it.melts for it in self.materials])[elements.material]

    def heat(self, elements: Elements) -> Heat:
        """Heat of elements at time 0.

        Raises
        ------
        ValueError
            When an element has a material that is not listed.
        """
        if (most := int(elements.material.max())) >= len(self.materials):
            raise ValueError(f"an element has material {most}; only {len(self.materials)} are "
                             "listed, counted from 0")  # fmt: skip
        start_k = np.array(self.initial_k)[elements.material]
        return Substance(elements.material, self.table).heat_at(start_k)


def check_casting(elements: Elements, filling: Filling) -> None:
    """Refuse what cannot solidify.

    Raises
    ------
    ValueError
        When nothing melts, all of it does, or a casting starts solid.
    """
    melts = filling.melts(elements)
    if not melts.any():
        raise ValueError("no element has a solidus; there must be a casting")
    if melts.all():
        raise ValueError("every element is casting; there must be a mould that takes its heat")
    for number in np.unique(elements.material[melts]):
        it, start_k = filling.materials[number], filling.initial_k[number]
        if start_k < it.solidus_k:
            raise ValueError(
                f"{it.name} starts at {start_k} K; it must start at its solidus of "
                f"{it.solidus_k} K or above"
            )
