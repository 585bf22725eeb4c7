"""Beds that are shaken once, and brought to rest from many phases of the last period."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from sandmould import ROOT
from sandmould.engines.program import Stage, StepCounts, build_program
from sandmould.engines.reference.session import ReferenceSession
from sandmould.kinds.sand.measure import measure_snapshot
from sandmould.scenario.scenario import Scenario
from sandmould.scenario.stages import StageKind
from sandmould.scenario.vibration import STOP_PERIODS, VibrationStage
from sandmould.study.plan.expand import expand
from sandmould.study.plan.load_study import open_study

STUDY = Path("config/studies/tube_demo.yaml")
MEASURES = ("solid_fraction", "tube_fill_fraction")
Row = dict[str, float]


@dataclass(frozen=True)
class Drive:
    """How the box vibrates."""

    frequency_hz: float
    acceleration_g: float


@dataclass(frozen=True)
class Beds:
    """How much is measured."""

    drives: tuple[Drive, ...]
    fillings: int
    moments: int
    """Phases of a period, evenly, and periods."""
    duration_s: float
    stops: tuple[float, ...]
    """Periods in which the box stops, to be compared."""


@dataclass(frozen=True)
class MovingBed:
    """A moment of a vibration."""

    at_speed: Row
    """What is measured there and then."""
    state: Any
    """Of the session."""
    steps: int
    """That the box has vibrated."""


class EndedVibration(VibrationStage):
    """A vibration that ends at any phase, after which the box stops in some periods."""

    stop_periods: float

    @property
    def whole_duration_s(self) -> float:
        """The duration as it is: no whole number of periods."""
        return self.duration_s

    @property
    def stop_s(self) -> float:
        """Time in which the box stops."""
        return self.stop_periods / self.frequency_hz


def scenes(fillings: int) -> list[Scenario]:
    """The tube of the demo, one scene a filling."""
    runs = expand(open_study(ROOT / STUDY))
    return [run.scenario for run in runs[:fillings]]


def filled_bed(scene: Scenario) -> tuple[ReferenceSession, Any]:
    """A session with all sand filled in and at rest, and its state."""
    program = build_program(scene)
    session = ReferenceSession(program)
    for stage in program.stages:
        if stage.layer:
            session.insert_layer(stage.layer)
            _compute(session, stage)
    return session, session.save_checkpoint()


def _compute(session: ReferenceSession, stage: Stage) -> None:
    session.start_stage(stage)
    while not session.stage_over:
        session.advance()
    session.end_stage()


def measured(scene: Scenario, session: ReferenceSession) -> Row:
    """What a study measures of packing and fill."""
    row = measure_snapshot(scene, session.snapshot())
    return {name: float(row[name]) for name in MEASURES}


def moments(
    scene: Scenario,
    filled: tuple[ReferenceSession, Any],
    drive: Drive,
    periods: Sequence[float],
) -> Iterator[MovingBed]:
    """Compute one vibration, and stand still at some of its periods.

    Parameters
    ----------
    scene : Scenario
    filled : tuple
        See ``filled_bed``.
    drive : Drive
    periods : sequence of float
        Ascending; a whole number is where a stage of a study ends.
    """
    session, state = filled
    session.restore_checkpoint(state)
    stage = VibrationStage(
        frequency_hz=drive.frequency_hz,
        acceleration_g=drive.acceleration_g,
        duration_s=(periods[-1] + 1) / drive.frequency_hz,
    )
    counts = StepCounts.of(scene)
    session.start_stage(Stage(StageKind.VIBRATE, 1, vibration=stage))
    began = session.steps
    for period in periods:
        end = counts.steps(period / drive.frequency_hz) + 1
        while session.steps - began < end:
            left_s = (end - session.steps + began) * counts.step_s
            session.advance(min(scene.record.series_every_s, left_s))
        yield MovingBed(measured(scene, session), session.save_checkpoint(), end)


def at_rest(
    scene: Scenario,
    session: ReferenceSession,
    moment: MovingBed,
    drive: Drive,
    stop_periods: float = STOP_PERIODS,
) -> Row:
    """Measures once the box has stopped, from a moment of its vibration, and the sand rests."""
    session.restore_checkpoint(moment.state)
    vibration = EndedVibration(
        frequency_hz=drive.frequency_hz,
        acceleration_g=drive.acceleration_g,
        duration_s=(moment.steps - 1) * session.step_s,
        stop_periods=stop_periods,
    )
    rule = scene.fill.settling
    times = {name: vibration.stop_s + getattr(rule, name) for name in ("shortest_s", "longest_s")}
    settling = rule.model_copy(update=times)
    stage = Stage(
        StageKind.REST,
        settling=settling,
        vibration=vibration,
        stops_smoothly=True,
        vibration_steps=moment.steps,
    )
    _compute(session, stage)
    if not session.at_rest:
        raise RuntimeError(f"the sand did not come to rest in {settling.longest_s:g} s")
    return measured(scene, session)
