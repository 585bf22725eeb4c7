"""A session in front of another one: what it does not change goes to the sand's participant."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from sandmould.engines.program import Stage
from sandmould.engines.session import SandSession, Shared
from sandmould.engines.snapshot import Snapshot
from sandmould.engines.table_periods import TablePeriod

Array = NDArray[np.float64]


class DelegatingSession:
    """The sand's participant behind the interface of a session; see ``Session`` for all members."""

    def __init__(self, sand: SandSession) -> None:
        self.sand = sand
        """Session of the engine that computes the grains."""

    @property
    def version(self) -> str:
        """Version of the engine."""
        return self.sand.version

    @property
    def grains(self) -> int:
        """Grains now in the box."""
        return self.sand.grains

    @property
    def step_s(self) -> float:
        """Time step."""
        return self.sand.step_s

    @property
    def stage(self) -> Stage:
        """Stage that is being computed."""
        return self.sand.stage

    @property
    def stage_over(self) -> bool:
        """Whether the stage's time is up or the sand at rest."""
        return self.sand.stage_over

    @property
    def at_rest(self) -> bool:
        """Whether the sand has come to rest in a stage of settling."""
        return self.sand.at_rest

    @property
    def rest_sentence(self) -> str:
        """What the last check for rest found."""
        return self.sand.rest_sentence

    @property
    def steps(self) -> int:
        """Steps since the run began."""
        return self.sand.steps

    @property
    def time_s(self) -> float:
        """Simulated time."""
        return self.sand.time_s

    @property
    def can_checkpoint(self) -> bool:
        """Whether the last advance ended a check."""
        return self.sand.can_checkpoint

    @property
    def is_root(self) -> bool:
        """Whether this process writes the files."""
        return self.sand.is_root

    def insert_layer(self, number: int) -> None:
        """Drop a planned layer from over the bed."""
        self.sand.insert_layer(number)

    def set_state(self, position_m: Array, velocity_m_s: Array, spin_rad_s: Array) -> None:
        """Place all grains now in the box exactly."""
        self.sand.set_state(position_m, velocity_m_s, spin_rad_s)

    def start_stage(self, stage: Stage) -> None:
        """Begin to settle or to vibrate."""
        self.sand.start_stage(stage)

    def advance(self, duration_s: float | None = None) -> None:
        """Compute for a duration, or up to the next check."""
        self.sand.advance(duration_s)

    def end_stage(self) -> None:
        """Close the stage that is over."""
        self.sand.end_stage()

    def snapshot(self) -> Snapshot:
        """State of all grains relative to the box."""
        return self.sand.snapshot()

    def surface_loads(self) -> Mapping[str, Array] | None:
        """Mean force of the sand on each surface over the last check, N."""
        return self.sand.surface_loads()

    def table_periods(self) -> list[TablePeriod]:
        """Give the periods of a vibration on mounts that have ended since the last asking."""
        return self.sand.table_periods()

    def exact_limit_s(self) -> float:
        """Limit of the sand's contacts."""
        return self.sand.exact_limit_s()

    def write_checkpoint(self, folder: Path) -> None:
        """Write all that a continued run needs."""
        self.sand.write_checkpoint(folder)

    def share(self, value: Shared) -> Shared:
        """Give the first rank's value to all ranks."""
        return self.sand.share(value)

    def close(self) -> None:
        """Free the engine."""
        self.sand.close()
