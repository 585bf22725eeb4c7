"""How hard the box is shaken at a setting, in words and for tables: mm, mm/s and g."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence

import numpy as np
import pandas as pd

from sandmould.runs.columns import finished
from sandmould.scenario.drive import DISPLACEMENT, VELOCITY, BoxDrive, laid_down_drive
from sandmould.scenario.scenario import Scenario

_COLUMNS = (DISPLACEMENT, VELOCITY)


def drive_of(scenario: Scenario, runs: pd.DataFrame) -> BoxDrive | None:
    """Drive of the first vibration of a setting; None where there is none, or none was measured.

    ``runs``: rows of the summary at the setting: a table on mounts moves as it was measured.
    """
    if not scenario.vibrations:
        return None
    stage = scenario.vibrations[0]
    if stage.unbalance is None:
        return laid_down_drive(stage)
    measured = runs.loc[finished(runs), DISPLACEMENT] if DISPLACEMENT in runs else pd.Series()
    displacement_m = float(pd.to_numeric(measured).mean())
    return BoxDrive(stage.frequency_hz, displacement_m) if math.isfinite(displacement_m) else None


def drive_at(
    summary: pd.DataFrame, keys: Sequence[str], setting: Mapping[str, float]
) -> BoxDrive | None:
    """The drive between the settings of a sweep; None where runs have none.

    Over one key logarithms are interpolated between the means of its settings, which is exact for
    an amplitude that is held. Over several keys it is the nearest setting's, each key over its
    range.
    """
    if not all(column in summary for column in _COLUMNS):
        return None
    rows = summary[finished(summary)].dropna(subset=[*_COLUMNS, *keys])
    if rows.empty:
        return None
    means = rows.groupby(list(keys))[list(_COLUMNS)].mean().reset_index()
    at = means[list(keys)].to_numpy(dtype=np.float64)
    wanted = np.array([setting[key] for key in keys])
    values = means[list(_COLUMNS)].to_numpy(dtype=np.float64)
    if len(keys) == 1 and (at > 0).all() and (values > 0).all():
        x, log = np.log(wanted[0]), np.log(values)
        found = np.exp([np.interp(x, np.log(at[:, 0]), log[:, i]) for i in range(len(_COLUMNS))])
    else:
        width = np.maximum(np.ptp(at, axis=0), np.finfo(float).tiny)
        found = values[int((((at - wanted) / width) ** 2).sum(axis=1).argmin())]
    displacement_m, velocity_m_s = found.tolist()
    if not displacement_m > 0.0:
        return None
    return BoxDrive(velocity_m_s / displacement_m / (2 * math.pi), displacement_m)
