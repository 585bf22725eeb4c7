"""Names of the columns of the tables that runs and studies leave; swept keys are columns too.

``reference/files.yaml`` says what each means, and the lists of measures where it is one.
"""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Final

from sandmould.runs.outcome import Outcome
from sandmould.scenario.stages import is_rest

if TYPE_CHECKING:
    import pandas as pd

RUN: Final = "run"
REPLICATE: Final = "replicate"
SEED: Final = "seed"
PART: Final = "part"

SWEEP: Final = "sweep"
CROSS_CHECK: Final = "cross_check"
CROSS_CHECK_OWN: Final = "cross_check, own engine"
CONTROL: Final = "control: "
"""Cells of ``part``: the sweep with its rounds, its point on another engine, the same point on the
study's own where the check vibrates for a time of its own, and the beginning of the name of a
control's case."""

OUTCOME_CODE: Final = "outcome_code"
OUTCOME: Final = "outcome"
DETAIL: Final = "detail"
SIMULATED_S: Final = "simulated_s"
PLANNED_S: Final = "planned_s"

ENGINE: Final = "engine"
VERSION: Final = "version"
RANKS: Final = "ranks"
WALL_S: Final = "wall_s"
CPU_S: Final = "cpu_s"
FILL: Final = "fill"
FILL_WALL_S: Final = "fill_wall_s"
FILL_CPU_S: Final = "fill_cpu_s"
GRAIN_STEPS_PER_S: Final = "grain_steps_per_s"
PEAK_MEMORY_BYTES: Final = "peak_memory_bytes"
TIME_STEP_S: Final = "time_step_s"
TIME_STEP_FRACTION: Final = "time_step_fraction"
BED_LIMIT_S: Final = "bed_limit_s"
LEAST_LIMIT_S: Final = "least_limit_s"
LIMIT_MOMENTS: Final = "limit_moments"
LARGEST_OVERLAP_FRACTION: Final = "largest_overlap_fraction"
OVERLAP_P99_FRACTION: Final = "overlap_p99_fraction"

TIME_S: Final = "time_s"
VIBRATION_TIME_S: Final = "vibration_time_s"
STAGE: Final = "stage"
GRAINS: Final = "grains"
SOLID_FRACTION: Final = "solid_fraction"
BED_HEIGHT_M: Final = "bed_height_m"
CLASSIFICATION: Final = "classification"
LOOP: Final = "pattern_loop"
LOOP_ERROR: Final = "pattern_loop_error_fraction"
HOPS: Final = "hops"
SOLIDIFICATION_TIME_S: Final = "solidification_time_s"

OF_OUTCOME: Final = (OUTCOME_CODE, OUTCOME, DETAIL, SIMULATED_S, PLANNED_S)
CLOCK: Final = (TIME_S, VIBRATION_TIME_S, STAGE)
OF_RUN: Final = frozenset({
    RUN, REPLICATE, SEED, PART, *OF_OUTCOME, ENGINE, VERSION, RANKS, WALL_S, CPU_S, FILL,
    FILL_WALL_S, FILL_CPU_S, GRAIN_STEPS_PER_S, PEAK_MEMORY_BYTES, TIME_STEP_S, TIME_STEP_FRACTION,
    BED_LIMIT_S, LEAST_LIMIT_S, LIMIT_MOMENTS, LARGEST_OVERLAP_FRACTION, *CLOCK, GRAINS,
    "begun_again", "steps", "grain_steps", "engine_wall_s", "elements", "element_steps",
    "particles", "particle_solves", "element_steps_per_s", "particle_solves_per_s",
    "poisson_iterations", "solver_fraction", "measured_time_s", "measured_vibration_time_s",
    "measured_stage", "measured_grains", "measured_largest_overlap_fraction",
})  # fmt: skip
"""Columns that runs of some kind have whatever is measured: no measure of a user's has their
names."""


def during_vibration(curves: pd.DataFrame) -> pd.DataFrame:
    """Rows of curves from the start of vibration to its end.

    The clock of vibration stands while the sand comes to rest, so those rows belong to no curve
    over it.
    """
    rests = curves[STAGE].map(lambda name: is_rest(str(name))).astype(bool)
    return curves[(curves[VIBRATION_TIME_S] >= 0) & ~rests]


def finished(summary: pd.DataFrame) -> pd.Series[bool]:
    """Which runs of a summary reached their end, by row."""
    return summary[OUTCOME_CODE] == int(Outcome.FINISHED)


def total_s(summary: pd.DataFrame, column: str) -> float:
    """Time of all runs and of the fills that they share; NaN where no run says it."""
    of_fills = {WALL_S: FILL_WALL_S, CPU_S: FILL_CPU_S}[column]
    if column not in summary:
        return math.nan
    return sum(float(summary[name].sum()) for name in (column, of_fills) if name in summary)
