"""The order of things in a run: layers, each at rest before the next, discharge, vibration."""

from __future__ import annotations

import math
from dataclasses import dataclass
from functools import cached_property

from sandmould.scenario.discharge import Discharge
from sandmould.scenario.fill import Settling
from sandmould.scenario.placement import (
    PlannedLayer,
    filled_measure,
    loose_height_m,
    plan_counts,
    plan_layer,
)
from sandmould.scenario.scenario import Scenario
from sandmould.scenario.stages import StageKind
from sandmould.scenario.vibration import VibrationStage

OUTFLOW = 0.6
"""Solid measure that flows through an outlet of width w in the time w^(1/2 - d) / sqrt(g): about
0.65 measured in 2D with an outlet of seven largest grains; only used to foretell times."""
REST_AFTER_FALL_S = 0.3
"""Guess of the time a bed needs to come to rest after the last grain has landed."""


@dataclass(frozen=True)
class Stage:
    """One part of a run: a layer falls and settles, sand flows out, or the box vibrates."""

    kind: StageKind
    number: int = 0
    """Among the stages of its kind, from 1; 0 of one that is the only one."""
    opens: str = ""
    """Plate that is taken away at the start."""
    settling: Settling | None = None
    """When the sand is at rest, which ends the stage; none in a vibration stage."""
    vibration: VibrationStage | None = None
    expected_s: float = 0.0
    """Duration: exact for vibration, a guess for settling."""

    @property
    def name(self) -> str:
        """Name in decks, snapshots and tables."""
        return self.kind.numbered(self.number)

    @property
    def layer(self) -> int:
        """Layer that falls at the start, from 1; 0 in any other stage."""
        return self.number if self.kind is StageKind.SETTLE else 0

    @property
    def counts_as_vibration(self) -> bool:
        """Whether the stage belongs to the vibration after the fill."""
        return self.kind is StageKind.VIBRATE


@dataclass(frozen=True)
class Program:
    """All stages of a run, and the grains they bring."""

    scenario: Scenario
    stages: tuple[Stage, ...]
    counts: tuple[int, ...]
    """Grains of each layer."""

    @cached_property
    def layers(self) -> tuple[PlannedLayer, ...]:
        """Where the grains of each layer start; drawn when first asked for."""
        return tuple(plan_layer(self.scenario, i + 1, count) for i, count in enumerate(self.counts))

    @cached_property
    def _masses_kg(self) -> tuple[float, ...]:
        s = self.scenario
        return tuple(
            float(s.sand.grain_mass_kg(1.0, s.dimension) * ((2 * x.radius_m) ** s.dimension).sum())
            for x in self.layers
        )

    def mass_kg(self, layers: int) -> float:
        """Mass of the grains of the first layers."""
        return sum(self._masses_kg[:layers])

    @property
    def expected_s(self) -> float:
        """Expected simulated time of the whole run."""
        return sum(stage.expected_s for stage in self.stages)

    @property
    def expected_grain_steps(self) -> float:
        """Sum over stages of grains present times steps."""
        total, grains = 0.0, 0
        for stage in self.stages:
            grains += self.counts[stage.layer - 1] if stage.layer else 0
            total += grains * stage.expected_s / self.scenario.step_s
        return total


def _settling_s(scenario: Scenario, count: int) -> float:
    """Guess of the time a layer needs: the fall of its highest grain, then coming to rest."""
    fall = loose_height_m(scenario, count) + scenario.fill.drop_height_m
    guess = math.sqrt(2 * fall / scenario.gravity_m_s2) if scenario.gravity_m_s2 > 0 else math.inf
    settling = scenario.fill.settling
    return min(max(guess + REST_AFTER_FALL_S, settling.shortest_s), settling.longest_s)


def _outflow_s(scenario: Scenario, discharge: Discharge) -> float:
    """Guess of the time that the sand takes to leave through a gate and come to rest."""
    gate, g, d = scenario.gate, scenario.gravity_m_s2, scenario.dimension
    if gate is None or g == 0.0:
        return discharge.settling.longest_s
    width = max(gate.size_m)
    flow = OUTFLOW * math.sqrt(g) * width ** (d - 0.5)
    guess = filled_measure(scenario) / flow + REST_AFTER_FALL_S
    return min(max(guess, discharge.settling.shortest_s), discharge.settling.longest_s)


def build_program(scenario: Scenario) -> Program:
    """Write out the stages of a scenario."""
    counts = plan_counts(scenario)
    between = scenario.fill.vibration_between_layers
    stages: list[Stage] = []
    for number, count in enumerate(counts, start=1):
        stages.append(
            Stage(
                StageKind.SETTLE,
                number,
                settling=scenario.fill.settling,
                expected_s=_settling_s(scenario, count),
            )
        )
        if between is not None and number < len(counts):
            stages.append(
                Stage(
                    StageKind.BETWEEN,
                    number,
                    vibration=between,
                    expected_s=between.whole_duration_s,
                )
            )
    if scenario.discharge is not None:
        stages.append(
            Stage(
                StageKind.DISCHARGE,
                opens=scenario.discharge.gate,
                settling=scenario.discharge.settling,
                expected_s=_outflow_s(scenario, scenario.discharge),
            )
        )
    stages += [
        Stage(
            StageKind.VIBRATE,
            number,
            vibration=stage,
            expected_s=stage.whole_duration_s,
        )
        for number, stage in enumerate(scenario.vibration, start=1)
    ]
    return Program(scenario, tuple(stages), tuple(counts))
