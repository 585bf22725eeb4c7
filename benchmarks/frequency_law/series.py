"""Curves of one measure over frequency, each of one scene, and where they have their optimum."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, fields
from typing import Any

import numpy as np
import pandas as pd

from sandmould.runs.formatting import setting_text
from sandmould.scenario.hardness import bed_hardness, column_mode_hz
from sandmould.scenario.scenario import Scenario
from sandmould.statistics.evidence import usable_values
from sandmould.statistics.optimum import Optimum, find_optimum
from sandmould.statistics.settings import number_blocks
from sandmould.statistics.spring_dependence import CurveLimbs, find_limbs

FREQUENCY = "vibration.0.frequency_hz"
MEASURE = "tube_fill_fraction"
BED_HEIGHT = "bed_height_m"
DRIVE = {
    "drive_acceleration_g": "acceleration_g",
    "drive_velocity_m_s": "velocity_m_s",
    "drive_displacement_m": "displacement_m",
}
"""Columns of a summary with the box's motion, and their names in a ``Series``."""


@dataclass(frozen=True)
class FillCurve:
    """Fill of one scene over frequency."""

    study: str
    label: str
    """What is special in it."""
    scenario: Scenario
    fillings: int
    depth_m: float
    """Of the bed at rest, mean over its runs."""
    fills: pd.DataFrame
    """A row a filling, a column a frequency in rising order; NaN where a run failed."""
    drives: pd.DataFrame
    """A row a frequency in the same order: ``DRIVE``, peaks of the box's motion."""

    @property
    def wave_speed_m_s(self) -> float:
        """Along a row of grains."""
        hardness = bed_hardness(self.scenario)
        assert hardness is not None
        return hardness.wave_speed_m_s

    @property
    def column_hz(self) -> float:
        """First mode of a column of rows as deep as the bed, c/(4 H)."""
        return column_mode_hz(self.wave_speed_m_s, self.depth_m)


@dataclass(frozen=True)
class Series(FillCurve):
    """A curve, and where it has its optimum."""

    limbs: CurveLimbs
    optimum: Optimum

    @property
    def best_hz(self) -> float:
        """Where the fitted mean is best."""
        return self.optimum.setting[FREQUENCY]

    @property
    def interval_hz(self) -> tuple[float, float]:
        """Where the optimum lies with 95 % probability."""
        return self.optimum.interval(FREQUENCY)


def series_of(
    study: str, summary: pd.DataFrame, keys: Sequence[str], scenarios: Mapping[Any, Scenario]
) -> list[Series]:
    """Curves of a study over frequency and at most one other key.

    Parameters
    ----------
    study : str
    summary : DataFrame
        One row a run.
    keys : sequence of str
        Swept keys, ``FREQUENCY`` among them.
    scenarios : mapping
        A scenario of each value of the other key; of None where there is none.

    Returns
    -------
    list of Series
        In the order of ``scenarios``.
    """
    other = next((key for key in keys if key != FREQUENCY), None)
    found = []
    for seed, (value, scenario) in enumerate(scenarios.items()):
        mine = summary if other is None else summary[summary[other] == value]
        used = _usable(mine)
        curve = fill_curve(
            study, "" if other is None else setting_text({other: value}), mine, scenario
        )
        found.append(
            Series(
                **{field.name: getattr(curve, field.name) for field in fields(curve)},
                limbs=find_limbs(
                    used[FREQUENCY].to_numpy(dtype=np.float64),
                    np.asarray(number_blocks(used)),
                    used[MEASURE].to_numpy(dtype=np.float64),
                ),
                # Draws of two curves must not share their random numbers.
                optimum=find_optimum(used, [FREQUENCY], MEASURE, "larger", seed),
            )
        )
    return found


def fill_curve(study: str, label: str, summary: pd.DataFrame, scenario: Scenario) -> FillCurve:
    """The curve of the runs of one scene, one row a run."""
    used = _usable(summary)
    filling = used.assign(filling=number_blocks(used))
    return FillCurve(
        study,
        label,
        scenario,
        int(used.groupby(FREQUENCY).size().median()),
        float(used[BED_HEIGHT].mean()),
        filling.pivot(index="filling", columns=FREQUENCY, values=MEASURE),
        used.groupby(FREQUENCY)[list(DRIVE)].mean().rename(columns=DRIVE),
    )


def _usable(summary: pd.DataFrame) -> pd.DataFrame:
    return summary.loc[usable_values(summary, MEASURE).dropna().index]
