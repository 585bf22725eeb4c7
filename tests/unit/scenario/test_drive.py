"""How hard the box is shaken: amplitudes of motions laid down and of measured periods."""

from __future__ import annotations

import math

import numpy as np
import pytest

from sandmould.scenario.drive import DISPLACEMENT, laid_down_drive, steady_drive
from sandmould.scenario.unbalance import Unbalance
from sandmould.scenario.vibration import VibrationStage


def test_one_amplitude_gives_the_others() -> None:
    drive = laid_down_drive(VibrationStage(acceleration_g=1.5, frequency_hz=50.0))
    # 1.5 x 9.80665 m/s2 over (2 pi 50 Hz)^2 and 2 pi 50 Hz
    assert drive.displacement_m == pytest.approx(1.4904e-4, rel=1e-4)
    assert drive.velocity_m_s == pytest.approx(46.823e-3, rel=1e-4)
    assert drive.acceleration_g == pytest.approx(1.5)
    assert drive.columns()[DISPLACEMENT] == drive.displacement_m


def steady_m(
    periods: list[float], phase_deg: list[float] | None = None, **stage: float
) -> float | None:
    given = {"frequency_hz": 50.0, "acceleration_g": 1.0, "duration_s": 0.12} | stage
    lags = np.array(phase_deg or [77.0] * len(periods))
    drive = steady_drive(VibrationStage(**given), np.array(periods), lags)
    return None if drive is None else drive.displacement_m


def test_the_second_half_of_a_vibration_is_steady() -> None:
    periods = [9.0, 9.0, 9.0, 1.0, 1.0, 1.0]
    assert steady_m(periods) == pytest.approx(1.0)
    # what turns its phase round in every period has not the drive's frequency
    assert steady_m(periods, [0.0, 0.0, 0.0, 30.0, 150.0, 270.0]) == pytest.approx(0.0, abs=1e-15)
    assert steady_m(periods[:1]) == pytest.approx(9.0)
    assert steady_m([]) is None


def test_ramps_are_not_steady() -> None:
    # two periods of ramp at either end of eight
    periods = [2.0, 4.0, 9.0, 9.0, 5.0, 5.0, 4.0, 2.0]
    ramped = {"duration_s": 0.16, "ramp_s": 0.04}
    assert steady_m(periods, **ramped) == pytest.approx(5.0)
    assert steady_m(periods[:3], **ramped) == pytest.approx(9.0)
    assert steady_m(periods[:2], **ramped) is None


def test_the_empty_table_in_closed_form() -> None:
    table = Unbalance(moment_kg_m=0.05, moving_mass_kg=50, mount_frequency_hz=5)
    omega_0 = 2 * math.pi * 5
    # at the resonance m e / (2 zeta M), far above it m e / M
    assert table.empty_amplitude_m(omega_0) == pytest.approx(0.05 / 50 / (2 * 0.05))
    assert table.empty_amplitude_m(100 * omega_0) == pytest.approx(0.05 / 50, rel=2e-4)
    # with three times its mass on it the resonance is at half the frequency
    added = table.empty_amplitude_m(omega_0 / 2, 150.0)
    assert added == pytest.approx(0.05 / 200 / (0.05 / 2 * 2))


def test_the_largest_amplitude_is_that_of_the_mass_that_tunes_the_table() -> None:
    table = Unbalance(
        moment_kg_m=0.05, moving_mass_kg=50, mount_frequency_hz=5, mount_damping_ratio=0.02
    )
    below = 0.8 * 2 * math.pi * 5
    masses = np.linspace(0.0, 100.0, 20001)
    largest = max(table.empty_amplitude_m(below, mass) for mass in masses)
    assert table.largest_amplitude_m(below, 100.0) == pytest.approx(largest, rel=1e-6)
    # too little sand to tune it: with all of it the table moves most
    some = table.largest_amplitude_m(below, 10.0)
    assert some == pytest.approx(table.empty_amplitude_m(below, 10.0))
