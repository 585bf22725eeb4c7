"""Times of a scenario as whole numbers of steps."""

from __future__ import annotations

import math
from dataclasses import dataclass

from sandmould.scenario.scenario import Scenario
from sandmould.scenario.vibration import VibrationStage

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
