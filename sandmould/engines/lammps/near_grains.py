"""Which grains a wall of a LAMMPS deck looks at: those so near that they could touch it soon.

A fix of a wall goes through all grains of its group in every step, and turns each one into the
frame of a turned block. So each wall has a group of the grains within ``reach_m`` of it: a radius
of the largest grain and a slack. The groups are made again before any grain can have gone the
slack, so that a grain outside cannot touch the wall meanwhile. Where a grain is too fast for that,
the groups are of all grains. A grain that leaves a group has no history of contact: forces were
computed where it now stands, away from the wall, and LAMMPS drops the history there.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import ClassVar

from sandmould.engines.deck import exact, vector
from sandmould.geometry.geometry import Block, Wall
from sandmould.scenario.scenario import Scenario
from sandmould.scenario.vibration import Shaking

MOST_GROUPS = 32 - 2
"""LAMMPS has 32 at most, one of them is ``all``, and a layer that falls takes one for a moment."""
SLACK_RADII = 1.0
"""Slack over the radius of the largest grain."""
_SLOWEST_M_S = 1e-3
"""Speed that is allowed where neither gravity nor the box moves a grain."""


@dataclass(frozen=True)
class NearGrains:
    """Groups of near grains of one scene."""

    scenario: Scenario
    most_steps: ClassVar[int] = 100
    """Steps after which groups are made again at the latest."""
    spare_steps: ClassVar[int] = 8
    """Steps by which they are made again before the fastest grain could have gone the slack."""
    speed_check_steps: ClassVar[int] = 5
    """Steps after which the speed of the fastest grain is looked at."""

    @property
    def slack_m(self) -> float:
        """How far a grain may go before the groups are made again."""
        return SLACK_RADII * self.scenario.largest_diameter_m / 2

    @property
    def reach_m(self) -> float:
        """Distance from a wall at rest up to which the centre of a grain counts as near.

        In the laboratory frame a wall moves by the amplitude.
        """
        moves = self.scenario.frame == "laboratory"
        amplitudes = [v.amplitude_m for v in self._vibrations] if moves else []
        return self.scenario.largest_diameter_m / 2 + self.slack_m + max(amplitudes, default=0.0)

    @property
    def gain_m_s(self) -> float:
        """Speed that gravity and the box can give a grain before the groups are made again."""
        time_s = self.most_steps * self.scenario.step_s
        shaken = [
            v.amplitude_m * v.angular_frequency_rad_s * (1.0 + v.angular_frequency_rad_s * time_s)
            for v in self._vibrations
        ]
        fallen = self.scenario.gravity_m_s2 * time_s
        return max(fallen + max(shaken, default=0.0), _SLOWEST_M_S)

    @property
    def _vibrations(self) -> list[Shaking]:
        return [*self.scenario.vibrations, *self.scenario.fill.shakings]

    @property
    def one_for_all(self) -> bool:
        """Whether all walls share one group, since LAMMPS has too few for one each."""
        return len(self._solids) > MOST_GROUPS

    @property
    def _solids(self) -> list[Wall | Block]:
        return [*self.scenario.scene.walls, *self.scenario.scene.blocks]

    @property
    def gate(self) -> str:
        """The plate that is taken away, which always has a group of its own."""
        return "" if self.scenario.discharge is None else self.scenario.discharge.gate

    def group(self, name: str) -> str:
        """Group of a wall or block."""
        return "near_walls" if self.one_for_all and name != self.gate else f"near_{name}"

    def groups(self, opened: bool = False) -> list[str]:
        """All groups, each once, without that of the gate where it is open."""
        names = [solid.name for solid in self._solids if not (opened and solid.name == self.gate)]
        return list(dict.fromkeys(map(self.group, names)))

    def commands(self, opened: bool = False) -> list[str]:
        """Commands that make the groups again."""
        clear = [f"group {group} clear" for group in self.groups(opened)]
        fill = [
            f"group {self.group(solid.name)} region near_{solid.name}"
            for solid in self._solids
            if not (opened and solid.name == self.gate)
        ]
        return clear + fill

    def commands_of_all(self, opened: bool = False) -> list[str]:
        """Commands that put all grains into the groups."""
        return [f"group {group} union all" for group in self.groups(opened)]

    def regions(self) -> list[tuple[str, str]]:
        """Name and shape of the region near each wall and block, as LAMMPS takes it."""
        return [(solid.name, self._shape(solid)) for solid in self._solids]

    def _shape(self, solid: Wall | Block) -> str:
        if isinstance(solid, Wall):
            point = solid.point_m + self.reach_m * solid.normal
            return f"plane {vector(point)} {vector(solid.normal)} side out"
        # Upright, so that no grain is turned.
        corners = solid.corners()
        low, high = corners.min(axis=0) - self.reach_m, corners.max(axis=0) + self.reach_m
        bounds = " ".join(f"{exact(a)} {exact(b)}" for a, b in zip(low, high, strict=True))
        return f"block {bounds}{' INF INF' if len(low) == 2 else ''}"

    def speed_bound(self) -> str:
        """Formula of a speed that no grain exceeds, m/s, of the greatest of each component."""
        d = self.scenario.dimension
        return "sqrt(" + "+".join(f"c_fastest[{i}]*c_fastest[{i}]" for i in range(1, d + 1)) + ")"
