"""The order of things in a run: layers, each at rest before the next, discharge, vibration."""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np

from sandmould.geometry.geometry import Array
from sandmould.scenario.box import Piston
from sandmould.scenario.fill import FLOW_SETTLING, Discharge, FillVibration, Settling
from sandmould.scenario.placement import PlannedLayer, plan_counts, plan_layer, portion_of
from sandmould.scenario.scenario import Scenario
from sandmould.scenario.stages import StageKind
from sandmould.scenario.vibration import RestStage, VibrationStage
from sandmould.sums import added

SETUP_CHECKS = 20
"""Checks after which LAMMPS and LIGGGHTS are set up anew, so that a checkpoint may be written."""


@dataclass(frozen=True)
class StepCounts:
    """Steps between load samples, checks and records; each a multiple of the one before.

    What is computed hangs on the first two alone.
    """

    step_s: float
    load: int
    check: int
    record: int

    @classmethod
    def of(cls, scenario: Scenario) -> StepCounts:
        """Round the intervals of a scenario."""
        step = scenario.step_s
        load = scenario.rest.load_every_steps
        check = load * max(1, round(scenario.rest.check_every_s / step / load))
        record = check * max(1, round(scenario.record.series_every_s / step / check))
        return cls(step, load, check, record)

    def steps(self, time_s: float) -> int:
        """Whole steps that cover a time."""
        return math.ceil(time_s / self.step_s * (1 - 1e-12))

    def records(self, interval_s: float) -> int:
        """Steps of an interval, rounded to whole records, at least one."""
        return self.record * max(1, round(interval_s / self.step_s / self.record))

    @property
    def setup(self) -> int:
        """Steps from one setup of LAMMPS or LIGGGHTS to the next, whatever is recorded."""
        return self.check * SETUP_CHECKS

    def checkpoints(self, interval_s: float, *, at_setups: bool) -> int:
        """Steps of an interval, rounded to whole records and, if need be, to whole setups."""
        whole = math.lcm(self.record, self.setup) if at_setups else self.record
        return whole * max(1, round(interval_s / self.step_s / whole))

    def vibration(self, stage: VibrationStage) -> int:
        """Steps of a vibration stage, with one at rest at either end."""
        return self.steps(stage.whole_duration_s) + 2


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
    duration_s: float = 0.0
    """As given; none where the sand must come to rest."""
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
            return "discharge.duration_s"
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
        return added(self._masses_kg[:layers])

    @property
    def fill_stages(self) -> int:
        """Stages before the first vibration; all where the box never vibrates."""
        shaken = (n for n, stage in enumerate(self.stages) if stage.counts_as_vibration)
        return next(shaken, len(self.stages))


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
    yield Stage(StageKind.PRESS, steps=steps, duration_s=piston.duration_s)
    yield Stage(StageKind.HOLD, settling=scenario.fill.settling)


def _flow(scenario: Scenario, discharge: Discharge) -> Iterator[Stage]:
    """The gate opens, and the sand flows until it rests or for a stated time."""
    counts, gate = StepCounts.of(scenario), discharge.gate
    opening_s, duration_s = discharge.opening_time_s or 0.0, discharge.duration_s
    opening = counts.steps(opening_s)
    if opening:
        yield Stage(StageKind.OPEN, slides=gate, steps=opening, duration_s=opening_s)
    if duration_s is None:
        yield Stage(StageKind.DISCHARGE, opens=gate, settling=FLOW_SETTLING)
    else:
        steps, left_s = counts.steps(duration_s) - opening, duration_s - opening_s
        yield Stage(StageKind.DISCHARGE, opens=gate, steps=steps, duration_s=left_s)


def _pours(scenario: Scenario, counts: list[int]) -> Iterator[Stage]:
    vibration, between = scenario.fill.vibration, scenario.fill.vibration_between_layers
    if vibration is not None:
        yield from _vibrated_pours(scenario, vibration, len(counts))
        return
    spout = scenario.fill.spout
    steps = 0 if spout is None else StepCounts.of(scenario).steps(spout.interval_s)
    for number in range(1, len(counts) + 1):
        layer = portion_of(scenario, number)[0]
        if spout is not None and number < len(counts) and (
            portion_of(scenario, number + 1)[0] == layer
        ):  # fmt: skip
            yield Stage(StageKind.POUR, number, steps=steps, duration_s=spout.interval_s)
            continue
        yield Stage(StageKind.SETTLE, number, settling=scenario.fill.settling)
        if between is not None and number < len(counts):
            yield Stage(
                StageKind.BETWEEN, number, vibration=between, duration_s=between.whole_duration_s
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
            duration_s=last_s if last else vibration.layer_s,
            stops_smoothly=True,
            vibration_steps=begin,
            steps=end - begin,
        )
        begin = end
    rest = RestStage(kind="rest", longest_s=scenario.fill.settling.longest_s)
    yield replace(_rest_stage(scenario, 0, rest, whole), kind=StageKind.SETTLE)


def _box_stages(scenario: Scenario) -> Iterator[Stage]:
    """Stages of vibration and rest after the fill; a default rest after the last has no number."""
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
                duration_s=stage.whole_duration_s,
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
        stops_smoothly=stop_s > 0,
        vibration_steps=0 if moved is None else StepCounts.of(scenario).vibration(moved),
    )


def displacements(stage: Stage, first: int, count: int, step_s: float) -> Array:
    """Displacement of the box along its direction at some steps of a stage, (count,) float64, m.

    ``first``: first step, counted from the stage's beginning.

    The motion starts one step into the stage, as in the decks.
    """
    if stage.vibration is None:
        return np.zeros(count)
    steps = np.arange(first, first + count) + stage.vibration_steps
    times: Array = (steps - 1) * np.float64(step_s)
    return stage.vibration.displacements_at(times, stage.stops_smoothly)


def start_of_grains(
    scenario: Scenario, stage: Stage, steps: int, step_s: float
) -> tuple[Array, Array]:
    """Where and how fast grains begin that stand still while the box vibrates.

    Returns
    -------
    shift_m : (d,) float64, m
        From their place in the box to that in the frame of the computation.
    velocity_m_s : (d,) float64, m/s
        In the frame of the computation, half a step ago.
    """
    zero = np.zeros(scenario.dimension)
    if stage.vibration is None:
        return zero, zero
    direction = np.array(stage.vibration.unit_direction(scenario.dimension))
    before, now = displacements(stage, steps - 1, 2, step_s)
    if scenario.frame == "box":
        return zero, -(now - before) / step_s * direction
    return now * direction, zero


def box_motion(scenario: Scenario, stage: Stage, steps: int, step_s: float) -> tuple[Array, Array]:
    """Displacement (d,) in m and velocity (d,) in m/s of the walls, zero in the box frame.

    ``steps``: since the stage began.

    Notes
    -----
    The motion starts one step into the stage, as in the decks; the velocity is that of the
    discrete motion, half a step to either side.
    """
    d = scenario.dimension
    vibration = stage.vibration
    if scenario.frame == "box" or vibration is None:
        return np.zeros(d), np.zeros(d)
    direction = np.array(vibration.unit_direction(d))
    before, now, after = displacements(stage, steps - 1, 3, step_s)
    return now * direction, (after - before) / (2 * step_s) * direction
