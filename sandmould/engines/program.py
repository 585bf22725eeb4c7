"""The order of things in a run: layers, each at rest before the next, discharge, vibration."""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import dataclass, replace
from functools import cached_property

from sandmould.engines.step_counts import StepCounts
from sandmould.scenario.box import Piston
from sandmould.scenario.discharge import Discharge
from sandmould.scenario.fill import FillVibration, Settling
from sandmould.scenario.placement import (
    PlannedLayer,
    fall_s,
    filled_measure,
    plan_counts,
    plan_layer,
    portion_of,
)
from sandmould.scenario.scenario import Scenario
from sandmould.scenario.stages import StageKind
from sandmould.scenario.vibration import RestStage, VibrationStage

OUTFLOW = {2: 0.78, 3: 0.43}
"""Solid measure that flows through an outlet in the time w^(1/2 - d) / sqrt(g), w its width less
``EDGE`` grains; only used to foretell times. In 2D measured, 0.65 without the edge at seven largest
grains; in 3D the 0.58 of Beverloo et al., Chem. Eng. Sci. 15 (1961) 260, for bulk measure and a
round outlet, as 0.74 of the area of a square one, times a solid fraction of 0.58."""
EDGE = 1.4
"""Median grains along the edge of an outlet through which nothing flows (Beverloo et al. 1961)."""
REST_AFTER_FLOW_S = 0.7
"""Guess of the time until the last grains of a heap have rolled out: with it six recorded studies
of hoppers needed 0.75 to 1.22 times what is foretold for the whole run."""
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
    slides: str = ""
    """Plate that slides away during the stage."""
    settling: Settling | None = None
    """When the sand is at rest, which ends the stage; none in one of a given duration."""
    vibration: VibrationStage | None = None
    """How the box moves; in a stage of rest, the vibration that it comes from."""
    expected_s: float = 0.0
    """Duration: exact for vibration, a guess for settling."""
    stops_smoothly: bool = False
    """Whether the box stops smoothly once the vibration is over, since a rest follows."""
    vibration_steps: int = 0
    """Steps that the box has vibrated when the stage begins: it stops in the stage of rest."""
    steps: int = 0
    """Steps of a stage of a given duration; 0 where its vibration has it."""

    @property
    def name(self) -> str:
        """Name in decks, snapshots and tables."""
        return self.kind.numbered(self.number)

    @property
    def layer(self) -> int:
        """Layer that falls at the start, or portion of one, from 1; 0 in any other stage."""
        return self.number if self.kind in (StageKind.SETTLE, StageKind.POUR) else 0

    def longest_steps(self, counts: StepCounts) -> int:
        """Steps that the stage lasts; at most, where the sand comes to rest."""
        if self.settling is not None:
            return counts.steps(self.settling.longest_s)
        if self.steps:
            return self.steps
        assert self.vibration is not None
        return counts.vibration(self.vibration)

    @property
    def stop_s(self) -> float:
        """Time in which the box stops at the beginning of a stage of rest."""
        if self.settling is None or self.vibration is None:
            return 0.0
        return self.vibration.stop_s

    @property
    def longest_key(self) -> str:
        """Key of the scenario that limits the time in which the sand must come to rest."""
        if self.kind is StageKind.DISCHARGE:
            return "discharge.settling.longest_s"
        if self.kind is StageKind.REST and self.number:
            return f"vibration.{self.number - 1}.longest_s"
        return "fill.settling.longest_s"

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

    @property
    def layer_numbers(self) -> list[int]:
        """Layer that each dropped one belongs to, from 1: it may be a portion of it."""
        return [portion_of(self.scenario, i + 1)[0] for i in range(len(self.counts))]

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
    def fill_stages(self) -> int:
        """Stages before the first vibration; all where the box never vibrates."""
        shaken = (n for n, stage in enumerate(self.stages) if stage.counts_as_vibration)
        return next(shaken, len(self.stages))

    def expected_grain_steps(self, first_stage: int = 0) -> float:
        """Sum over stages of grains present times steps, from a stage on."""
        total, grains = 0.0, 0
        for number, stage in enumerate(self.stages):
            grains += self.counts[stage.layer - 1] if stage.layer else 0
            if number >= first_stage:
                total += grains * stage.expected_s / self.scenario.step_s
        return total


def _settling_s(scenario: Scenario, count: int) -> float:
    """Guess of the time a layer needs: the fall of its highest grain, then coming to rest."""
    settling = scenario.fill.settling
    return min(
        max(fall_s(scenario, count) + REST_AFTER_FALL_S, settling.shortest_s), settling.longest_s
    )


def _outflow_s(scenario: Scenario, discharge: Discharge) -> float:
    """Guess of the time that the sand takes to leave through a gate and come to rest."""
    gate, g, d = scenario.gate, scenario.gravity_m_s2, scenario.dimension
    if gate is None or g == 0.0:
        return discharge.settling.longest_s
    width = max(gate.size_m) - EDGE * scenario.sand.mass_median_diameter_m
    if width <= 0.0:
        return discharge.settling.longest_s
    flow = OUTFLOW[d] * math.sqrt(g) * width ** (d - 0.5)
    guess = filled_measure(scenario) / flow + REST_AFTER_FLOW_S
    return min(max(guess, discharge.settling.shortest_s), discharge.settling.longest_s)


def build_program(scenario: Scenario) -> Program:
    """Write out the stages of a scenario."""
    counts = plan_counts(scenario)
    stages = [*_pours(scenario, counts)]
    if scenario.piston is not None:
        stages += _press(scenario, scenario.piston)
    if scenario.discharge is not None:
        stages += _flow(scenario, scenario.discharge)
    return Program(scenario, (*stages, *_box_stages(scenario)), tuple(counts))


def _press(scenario: Scenario, piston: Piston) -> Iterator[Stage]:
    """A wall moves into the sand, which comes to rest once it stands."""
    steps = StepCounts.of(scenario).steps(piston.duration_s)
    yield Stage(StageKind.PRESS, steps=steps, expected_s=piston.duration_s)
    settling = scenario.fill.settling
    rest_s = min(max(REST_AFTER_FALL_S, settling.shortest_s), settling.longest_s)
    yield Stage(StageKind.HOLD, settling=settling, expected_s=rest_s)


def _flow(scenario: Scenario, discharge: Discharge) -> Iterator[Stage]:
    """The gate opens, and the sand flows until it rests or for a stated time."""
    counts, gate = StepCounts.of(scenario), discharge.gate
    opening_s, duration_s = discharge.opening_time_s or 0.0, discharge.duration_s
    opening = counts.steps(opening_s)
    if opening:
        yield Stage(StageKind.OPEN, slides=gate, steps=opening, expected_s=opening_s)
    if duration_s is None:
        expected_s = _outflow_s(scenario, discharge)
        settling = discharge.settling
        yield Stage(StageKind.DISCHARGE, opens=gate, settling=settling, expected_s=expected_s)
    else:
        steps, left_s = counts.steps(duration_s) - opening, duration_s - opening_s
        yield Stage(StageKind.DISCHARGE, opens=gate, steps=steps, expected_s=left_s)


def _pours(scenario: Scenario, counts: list[int]) -> Iterator[Stage]:
    """Stages of the fill."""
    vibration, between = scenario.fill.vibration, scenario.fill.vibration_between_layers
    if vibration is not None:
        yield from _vibrated_pours(scenario, vibration, len(counts))
        return
    spout = scenario.fill.spout
    steps = 0 if spout is None else StepCounts.of(scenario).steps(spout.interval_s)
    for number, count in enumerate(counts, start=1):
        layer = portion_of(scenario, number)[0]
        if spout is not None and number < len(counts) and (
            portion_of(scenario, number + 1)[0] == layer
        ):  # fmt: skip
            yield Stage(StageKind.POUR, number, steps=steps, expected_s=spout.interval_s)
            continue
        yield Stage(
            StageKind.SETTLE,
            number,
            settling=scenario.fill.settling,
            expected_s=_settling_s(scenario, count),
        )
        if between is not None and number < len(counts):
            yield Stage(
                StageKind.BETWEEN, number, vibration=between, expected_s=between.whole_duration_s
            )


def _vibrated_pours(scenario: Scenario, vibration: FillVibration, layers: int) -> Iterator[Stage]:
    """Layers that fall into the vibrating box; once it has stopped, the sand comes to rest."""
    counts, whole = StepCounts.of(scenario), vibration.over(layers)
    last_s = whole.whole_duration_s - (layers - 1) * vibration.layer_s
    begin = 0
    for number in range(1, layers + 1):
        last = number == layers
        end = counts.vibration(whole) if last else counts.steps(number * vibration.layer_s)
        yield Stage(
            StageKind.POUR,
            number,
            vibration=whole,
            expected_s=last_s if last else vibration.layer_s,
            stops_smoothly=True,
            vibration_steps=begin,
            steps=end - begin,
        )
        begin = end
    rest = RestStage(kind="rest", longest_s=scenario.fill.settling.longest_s)
    yield replace(_rest_stage(scenario, 0, rest, whole), kind=StageKind.SETTLE)


def _box_stages(scenario: Scenario) -> Iterator[Stage]:
    """Stages of vibration and rest after the fill, numbered by their place in the scenario.

    The rest that follows the last vibration by default has no number.
    """
    planned: list[tuple[int, VibrationStage | RestStage]] = [*enumerate(scenario.vibration, 1)]
    if scenario.measure_at_rest and planned and isinstance(planned[-1][1], VibrationStage):
        longest_s = scenario.fill.settling.longest_s
        planned.append((0, RestStage(kind="rest", longest_s=longest_s)))
    moved: VibrationStage | None = None
    for place, (number, stage) in enumerate(planned):
        if isinstance(stage, VibrationStage):
            following = planned[place + 1 : place + 2]
            stops = bool(following) and isinstance(following[0][1], RestStage)
            yield Stage(
                StageKind.VIBRATE,
                number,
                vibration=stage,
                expected_s=stage.whole_duration_s,
                stops_smoothly=stops and stage.stop_s > 0,
            )
            moved = stage
        else:
            yield _rest_stage(scenario, number, stage, moved)
            moved = None


def _rest_stage(
    scenario: Scenario, number: int, rest: RestStage, moved: VibrationStage | None
) -> Stage:
    """A stage of rest: the rule of the fill is applied once the box stands."""
    stop_s = 0.0 if moved is None else moved.stop_s
    rule = scenario.fill.settling
    times = {"shortest_s": rule.shortest_s, "longest_s": rest.longest_s}
    settling = rule.model_copy(update={k: round(stop_s + t, 9) for k, t in times.items()})
    return Stage(
        StageKind.REST,
        number,
        settling=settling,
        vibration=moved,
        expected_s=min(max(stop_s + REST_AFTER_FALL_S, settling.shortest_s), settling.longest_s),
        stops_smoothly=stop_s > 0,
        vibration_steps=0 if moved is None else StepCounts.of(scenario).vibration(moved),
    )
