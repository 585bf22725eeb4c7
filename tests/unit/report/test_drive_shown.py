"""The drive at a setting and at an optimum between settings."""

from __future__ import annotations

import numpy as np
import pandas as pd
import pytest

from sandmould.report.answer import drive_at
from sandmould.report.kinds.sand import drive_of
from sandmould.runs.columns import OUTCOME_CODE
from sandmould.scenario.drive import DISPLACEMENT, VELOCITY, BoxDrive
from sandmould.scenario.scenario import Scenario

KEY = "vibration.0.frequency_hz"
TABLE = {"moment_kg_m": 1, "moving_mass_kg": 60, "mount_frequency_hz": 8, "flask_depth_m": 0.3}


def runs(frequencies_hz: list[float], power: float = -2.0) -> pd.DataFrame:
    """Two runs a setting whose amplitudes differ by a fifth to either side of 1 mm (f/50)^power."""
    rows = []
    for frequency_hz in frequencies_hz:
        for share in (0.8, 1.2):
            drive = BoxDrive(frequency_hz, share * 1e-3 * (frequency_hz / 50.0) ** power)
            rows.append({KEY: frequency_hz, OUTCOME_CODE: 0, **drive.columns()})
    return pd.DataFrame(rows)


def test_between_settings_a_held_acceleration_stays_held() -> None:
    found = drive_at(runs([20.0, 40.0, 80.0]), [KEY], {KEY: 57.0})
    assert found is not None
    exact = BoxDrive(57.0, 1e-3 * (57.0 / 50.0) ** -2)
    assert found.columns() == pytest.approx(exact.columns())


def test_runs_that_failed_and_those_without_a_drive_do_not_count() -> None:
    table = runs([20.0, 40.0])
    broken = runs([40.0]).assign(**{OUTCOME_CODE: 5, DISPLACEMENT: 99.0})
    found = drive_at(pd.concat([table, broken]), [KEY], {KEY: 40.0})
    assert found is not None
    assert found.displacement_m == pytest.approx(1e-3 * (40.0 / 50.0) ** -2)
    assert drive_at(table.drop(columns=VELOCITY), [KEY], {KEY: 40.0}) is None
    assert drive_at(table.assign(**{DISPLACEMENT: np.nan}), [KEY], {KEY: 40.0}) is None


def test_over_several_keys_the_nearest_setting_tells_the_drive() -> None:
    table = pd.concat([runs([20.0, 80.0]).assign(height=h) for h in (1.0, 2.0)])
    table.loc[table.height == 2.0, DISPLACEMENT] *= 10
    found = drive_at(table, [KEY, "height"], {KEY: 70.0, "height": 1.8})
    assert found is not None
    assert found.displacement_m == pytest.approx(1e-2 * (80.0 / 50.0) ** -2)


def test_a_table_on_mounts_is_shown_as_measured() -> None:
    stage = {"hold": "unbalance", "unbalance": TABLE, "frequency_hz": 50.0}
    scenario = Scenario.model_validate({"vibration": [stage]})
    drive = drive_of(scenario, runs([50.0]))
    assert drive is not None
    assert drive.displacement_m == pytest.approx(1e-3)
    assert drive_of(scenario, runs([50.0]).drop(columns=DISPLACEMENT)) is None
    assert drive_of(Scenario(), runs([50.0])) is None
    laid_down = Scenario.model_validate({"vibration": [{"acceleration_g": 1.5}]})
    assert drive_of(laid_down, runs([50.0])) == BoxDrive(50.0, laid_down.vibrations[0].amplitude_m)
