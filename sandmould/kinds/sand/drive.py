"""How hard the box of a run was shaken, beside what was measured on its sand."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pandas as pd

from sandmould.runs.columns import STAGE, VIBRATION_TIME_S
from sandmould.runs.products import TABLE_PERIODS
from sandmould.scenario.drive import BoxDrive, laid_down_drive, steady_drive
from sandmould.scenario.scenario import Scenario
from sandmould.scenario.stages import StageKind
from sandmould.scenario.vibration import VibrationStage

_NO_DRIVE = BoxDrive(np.nan, np.nan)


def add_drive(scenario: Scenario, table: pd.DataFrame, folder: Path) -> pd.DataFrame:
    """Add the amplitudes of the box's motion up to each snapshot.

    ``table``: measures of a run's snapshots, in order of time.

    Returns
    -------
    DataFrame
        Gaps before the first vibration; in a rest, the amplitudes of the vibration before it.
    """
    if not scenario.vibrations:
        return table
    path = folder / TABLE_PERIODS
    periods = pd.read_csv(path, sep="\t") if path.exists() else None
    stages = {
        StageKind.VIBRATE.numbered(number): stage
        for number, stage in enumerate(scenario.vibration, start=1)
        if isinstance(stage, VibrationStage)
    }
    drives, current = [], ""
    for name, time_s in zip(table[STAGE], table[VIBRATION_TIME_S], strict=True):
        current = str(name) if str(name) in stages else current
        drive = _drive(current, stages[current], time_s, periods) if current else _NO_DRIVE
        drives.append(drive.columns())
    columns = pd.DataFrame(drives, columns=list(_NO_DRIVE.columns()), index=table.index)
    return pd.concat([table, columns], axis=1)


def _drive(
    name: str, stage: VibrationStage, time_s: float, periods: pd.DataFrame | None
) -> BoxDrive:
    """Amplitudes of a stage up to a time of vibration."""
    if stage.unbalance is None:
        return laid_down_drive(stage)
    if periods is None:
        return _NO_DRIVE
    # Half a period: the clock of a snapshot and the end of a period differ by round-off.
    until_s = time_s + 0.5 / stage.frequency_hz
    ended = periods[(periods[STAGE] == name) & (periods[VIBRATION_TIME_S] <= until_s)]
    values = (ended[c].to_numpy(dtype=np.float64) for c in ("displacement_m", "phase_deg"))
    return steady_drive(stage, *values) or _NO_DRIVE
