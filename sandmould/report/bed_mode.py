"""The first mode of the bed beside a frequency: as a small shake measured it, or as c/(4 H)."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import pandas as pd

from sandmould.analysis.spectrum import first_resonance_hz
from sandmould.runs.columns import BED_HEIGHT_M
from sandmould.runs.templates import worded
from sandmould.scenario.hardness import bed_hardness, column_mode_hz, column_speed_m_s
from sandmould.scenario.scenario import Scenario
from sandmould.statistics.recommendation import ModelWaveSpeed

Response = tuple[np.ndarray, np.ndarray]
"""Frequencies, Hz, and the amplification at each."""


@dataclass(frozen=True)
class BedMode:
    """The lowest frequency at which a bed swings by itself."""

    depth_m: float
    row_speed_m_s: float
    """Wave speed of a row of grains."""
    measured_hz: float
    """By a small shake, the mean of its fillings; NaN where it was not measured."""
    depth_is: str = "measured"
    """Whether its depth was measured, or is the planned one."""

    @property
    def is_measured(self) -> bool:
        """Whether a small shake found it."""
        return math.isfinite(self.measured_hz)

    @property
    def estimate_hz(self) -> float:
        """c/(4 H) with the wave speed of a row of grains: a bed is no row."""
        return column_mode_hz(self.row_speed_m_s, self.depth_m)

    @property
    def wave_speed(self) -> ModelWaveSpeed:
        """Speed of waves in the bed: 4 H f of the measured mode, else that of a row."""
        if self.is_measured:
            speed_m_s = column_speed_m_s(self.measured_hz, self.depth_m)
            return ModelWaveSpeed(speed_m_s, "4 H f of the bed's measured mode")
        return ModelWaveSpeed(self.row_speed_m_s, "of a row of grains, an estimate")

    def beside(self, frequency_hz: float) -> str:
        """Say what a frequency is over the mode, as a sentence."""
        return worded("bed_mode.j2", it=self, frequency_hz=frequency_hz)


def bed_mode(
    scenario: Scenario, summary: pd.DataFrame, responses: Sequence[Response] = ()
) -> BedMode | None:
    """First mode of the beds of a study; None of a scene where nothing vibrates or presses.

    Heights of beds in ``summary`` count, the expected one where it has none.
    """
    hardness = bed_hardness(scenario)
    if hardness is None or not scenario.vibrations:
        return None
    depth_m = math.nan
    if BED_HEIGHT_M in summary:
        depth_m = float(pd.to_numeric(summary[BED_HEIGHT_M], errors="coerce").median())
    found_hz = [first_resonance_hz(f, r) for f, r in responses]
    finite_hz = [f for f in found_hz if math.isfinite(f)]
    return BedMode(
        depth_m if depth_m > 0.0 else hardness.depth_m,
        hardness.wave_speed_m_s,
        float(np.mean(finite_hz)) if finite_hz else math.nan,
        "measured" if depth_m > 0.0 else "planned",
    )
