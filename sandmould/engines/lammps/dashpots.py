"""How LAMMPS is told its dashpots: one restitution a pair of size classes, one for walls."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

from sandmould.scenario.contact import Contact, ContactLaw, restitution


@dataclass(frozen=True)
class Dashpot:
    """One restitution of the deck."""

    ratio: float
    """The damping ratio that it stands for."""

    @property
    def restitution(self) -> float:
        """What ``damping coeff_restitution`` makes c = 2 ratio sqrt(k_n m) of."""
        return restitution(self.ratio)


@dataclass(frozen=True)
class Dashpots:
    """Dashpots of all contacts of a deck.

    A fix of a wall has one restitution for all grains, so that c is in proportion to sqrt(m).
    Corrected coefficients c / (1 + c dt / (4 m)) are not quite: walls take the mean of the damping
    ratios that the smallest and the largest class ask for (docs/stability.md).
    """

    contact: Contact
    classes: list[dict[str, Any]]
    """As ``sandmould.engines.deck_lines.size_classes`` gives them."""
    lag_s: float

    def pair(self, i: dict[str, Any], j: dict[str, Any]) -> Dashpot:
        """Of grains of two size classes."""
        mass = i["mass_kg"] * j["mass_kg"] / (i["mass_kg"] + j["mass_kg"])
        return Dashpot(self.contact.grain_grain.dashpot_ratio(mass, self.lag_s))

    @property
    def wall(self) -> Dashpot:
        """Of all grains at walls."""
        law: ContactLaw = self.contact.grain_wall
        ends = (self.classes[0], self.classes[-1])
        low, high = (law.dashpot_ratio(size["mass_kg"], self.lag_s) for size in ends)
        return Dashpot(low + 0.5 * (high - low))
