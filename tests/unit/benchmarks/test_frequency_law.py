"""What a best frequency goes with, on planted curves."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
import pandas as pd
import pytest

from benchmarks.frequency_law.controls import RecordedCurves
from benchmarks.frequency_law.groups import (
    LAW,
    FillLaw,
    collapses,
    held_out,
    settings_of,
    thrown,
)
from benchmarks.frequency_law.page import COLLAPSED, HELD_OUT, OF_THE_TUBE, _recorded, fill_map
from benchmarks.frequency_law.series import FREQUENCY, MEASURE, series_of
from sandmould.execution.records import RECORDS
from sandmould.kinds.sand.table_motion import MAP
from sandmould.runs.columns import OUTCOME_CODE, REPLICATE, SEED
from sandmould.scenario.scenario import Scenario

SPEED = "contact.wave_speed_m_s"
SPEEDS_M_S = (64.0, 128.0, 256.0)
ASKED = ("acceleration_g", "velocity_m_s", "in_modes")
FREQUENCIES_HZ = (15.0, 21.0, 30.0, 42.0, 60.0, 85.0, 120.0, 170.0, 240.0)


def drive(hz: float, velocity_m_s: float) -> dict[str, float]:
    """Peaks of a sine."""
    turn = 2 * np.pi * hz
    return {"drive_velocity_m_s": velocity_m_s, "drive_displacement_m": velocity_m_s / turn,
            "drive_acceleration_g": velocity_m_s * turn / 9.81}  # fmt: skip


def planted(exponent: float, drop: float) -> pd.DataFrame:
    """Curves with their tops at 60 Hz (c / 128 m/s)^exponent and so much lower a decade away."""
    noise = np.random.default_rng(4)
    rows = []
    for speed in SPEEDS_M_S:
        top_hz = 60.0 * (speed / 128.0) ** exponent
        for replicate in range(1, 5):
            filling = noise.normal(0.0, 0.02)
            for hz in FREQUENCIES_HZ:
                away = np.log10(hz / top_hz)
                value = 0.5 - drop * away**2 + filling + noise.normal(0.0, 0.01)
                rows.append(
                    {SPEED: speed, FREQUENCY: hz, REPLICATE: replicate, SEED: replicate,
                     MEASURE: value, "bed_height_m": 0.08, OUTCOME_CODE: 0,
                     **drive(hz, 1.5 * 9.81 / (2 * np.pi * hz))}
                )  # fmt: skip
    return pd.DataFrame(rows)


def scenes() -> dict[float, Scenario]:
    return {speed: Scenario.model_validate({"contact": {"wave_speed_m_s": speed}})
            for speed in SPEEDS_M_S}  # fmt: skip


@pytest.mark.parametrize(("drop", "shape"), [(0.6, "inner"), (0.0, "open")])
def test_a_planted_top_lies_inside_and_a_flat_curve_has_none(drop: float, shape: str) -> None:
    curves = series_of("planted", planted(1.0, drop), (SPEED, FREQUENCY), scenes())
    assert [s.wave_speed_m_s for s in curves] == pytest.approx(list(SPEEDS_M_S))
    assert curves[1].column_hz == pytest.approx(128.0 / (4 * 0.08))
    assert {s.limbs.shape for s in curves} == {shape}


def planted_settings(law: Callable[[float, float, float], float]) -> pd.DataFrame:
    """Settings of curves of three wave speeds, each with acceleration, velocity or stroke held."""
    series = []
    for held in (1.0, 0.0, -1.0):
        runs = planted(0.0, 0.0)
        velocities = 0.04 * (runs[FREQUENCY] / 60.0) ** -held
        runs = runs.assign(**pd.DataFrame(list(map(drive, runs[FREQUENCY], velocities))))
        modes = runs[SPEED] / (4 * 0.08)
        runs[MEASURE] = list(map(law, runs[FREQUENCY], velocities, modes))
        series += series_of(f"held {held:g}", runs, (SPEED, FREQUENCY), scenes())
    return settings_of(series)


@pytest.mark.parametrize(
    ("law", "groups"),
    [
        (lambda hz, v, mode: 0.5 + 0.1 * np.log(v / 0.04) + 0.2 * np.tanh(5 * hz / mode),
         ("velocity_m_s", "in_modes")),
        (lambda hz, v, mode: 0.5 + 0.1 * np.log(hz * v) + 0.2 * np.tanh(5 * hz / mode),
         ("acceleration_g", "in_modes")),
    ],
)  # fmt: skip
def test_the_planted_pair_of_groups_collapses_the_curves(
    law: Callable[[float, float, float], float], groups: tuple[str, str]
) -> None:
    settings = planted_settings(law)
    pairs = [found for found in collapses(settings, ASKED) if len(found.groups) == 2]
    assert pairs[0].groups == groups
    assert pairs[0].error < 0.5 * pairs[1].error
    # The whole is the same for a curve that the law was not fitted to, but for a shift.
    others = settings[settings["curve"] == 0].assign(fill=lambda rows: rows["fill"] + 0.05)
    asked = held_out(settings, others)
    if groups == LAW:
        assert asked.shift == pytest.approx(0.05, abs=0.01)
        assert asked.best_in_modes("predicted") == asked.best_in_modes("fill")


def test_a_single_group_is_best_where_the_fill_goes_with_it_alone() -> None:
    settings = planted_settings(lambda hz, v, mode: 0.5 + 0.1 * np.log(hz))
    best = collapses(settings, ("velocity_m_s", "frequency_hz"))[0]
    assert best.groups == ("frequency_hz",)
    assert best.error < 0.1 * settings["fill"].std()


def test_the_frequency_that_others_foretell_loses_little_where_the_acceleration_is_held() -> None:
    recorded = _recorded(RECORDS)
    curves = [
        c for study in recorded.values() for c in study["series"] if c.scenario.dimension == 2
    ]
    for name in HELD_OUT:
        curves += RecordedCurves(RECORDS / name).curves
    settings = thrown(settings_of(curves))
    regrets = []
    for curve in settings["curve"].unique():
        mine = settings[settings["curve"] == curve]
        if mine["acceleration_g"].max() > 1.05 * mine["acceleration_g"].min():
            continue
        of_tube = settings["study"].isin((*COLLAPSED, *OF_THE_TUBE))
        law = FillLaw(settings[of_tube & (settings["curve"] != curve)])
        regrets.append(mine["fill"].max() - mine["fill"].iloc[int(law.at(mine).argmax())])
    assert len(regrets) == 11
    assert max(regrets) <= 0.03


@pytest.mark.slow
def test_the_map_of_plans_is_that_of_the_records() -> None:
    assert MAP.read_text("utf-8") == fill_map()
