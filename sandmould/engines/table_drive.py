"""What drives a table on mounts in a stage: the force of its masses, and the brake after it."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from sandmould.dem.table import MountedTable, TableDrive
from sandmould.engines.program import Program, Stage
from sandmould.geometry.geometry import Array
from sandmould.scenario.scenario import Scenario
from sandmould.scenario.unbalance import BRAKE_PERIODS, Unbalance
from sandmould.scenario.vibration import STOP_PERIODS, VibrationStage


@dataclass(frozen=True)
class TableMotion:
    """How a table is driven in a stage, or comes to rest in it."""

    vibration: VibrationStage
    """The stage's own, or the last one before it."""
    steps_before: int | None
    """Steps since that vibration began when the stage begins; None where it is long over."""
    stops_smoothly: bool

    @property
    def unbalance(self) -> Unbalance:
        """Table, mounts and rotating masses."""
        assert self.vibration.unbalance is not None
        return self.vibration.unbalance

    def table(self, scenario: Scenario, weight_n: float) -> MountedTable:
        """The table under sand of a weight."""
        direction = self.vibration.unit_direction(scenario.dimension)
        unbalance = self.unbalance
        return MountedTable(
            unbalance.moving_mass_kg,
            unbalance.stiffness_n_m,
            scenario.sand_share(unbalance),
            -weight_n * direction[-1],
        )

    def times_s(self, first: int, count: int, step_s: float) -> Array:
        """Time since the vibration began at some steps of the stage; see ``displacements``."""
        if self.steps_before is None:
            long_over_s = 2 * max(STOP_PERIODS, BRAKE_PERIODS) / self.vibration.frequency_hz
            return np.full(count, self.vibration.whole_duration_s + long_over_s)
        steps = np.arange(first, first + count) + self.steps_before
        times: Array = (steps - 1) * np.float64(step_s)
        return times

    def drive(self, times_s: Array) -> TableDrive:
        """Force and damping at some times since the vibration began.

        Once it is over, a brake brings the damping of the mounts up to the critical one, so that
        the table comes back to its place without swinging.
        """
        stage, unbalance = self.vibration, self.unbalance
        over_s = np.maximum(0.0, times_s - stage.whole_duration_s)
        braked = np.minimum(1.0, over_s * stage.frequency_hz / BRAKE_PERIODS)
        more = max(0.0, unbalance.critical_damping_kg_s - unbalance.damping_kg_s)
        return TableDrive(
            stage.unbalance_forces_at(times_s, self.stops_smoothly),
            unbalance.damping_kg_s + more * 0.5 * (1.0 - np.cos(np.pi * braked)),
        )


def table_motion(program: Program, stage: Stage) -> TableMotion | None:
    """How the table moves in a stage; None where it stands, or moves as laid down."""
    vibration = stage.vibration
    if vibration is not None:
        if vibration.unbalance is None:
            return None
        return TableMotion(vibration, stage.vibration_steps, stage.stops_smoothly)
    before = program.stages[: program.stages.index(stage)] if stage in program.stages else ()
    earlier = [s.vibration for s in before if s.vibration is not None and not s.kind.fills]
    if not earlier or earlier[-1].unbalance is None:
        return None
    return TableMotion(earlier[-1], None, stops_smoothly=False)
