"""Times of a scenario as whole numbers of steps."""

from __future__ import annotations

import math
from dataclasses import dataclass

from sandmould.scenario.scenario import Scenario
from sandmould.scenario.vibration import VibrationStage


@dataclass(frozen=True)
class StepCounts:
    """Steps between load samples and between records; the second a multiple of the first."""

    step_s: float
    load: int
    window: int

    @classmethod
    def of(cls, scenario: Scenario) -> StepCounts:
        """Round the intervals of a scenario."""
        step = scenario.step_s
        load = scenario.record.load_every_steps
        window = load * max(1, round(scenario.record.series_every_s / step / load))
        return cls(step, load, window)

    def steps(self, time_s: float) -> int:
        """Whole steps that cover a time."""
        return math.ceil(time_s / self.step_s * (1 - 1e-12))

    def windows(self, interval_s: float) -> int:
        """Steps of an interval, rounded to whole windows, at least one."""
        return self.window * max(1, round(interval_s / self.step_s / self.window))

    def vibration(self, stage: VibrationStage) -> int:
        """Steps of a vibration stage, with one at rest at either end."""
        return self.steps(stage.whole_duration_s) + 2
