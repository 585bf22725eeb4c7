"""How hard a box is shaken: amplitudes of its motion at the frequency of its drive.

Of a motion that is laid down they follow from its formula, of a table on mounts from what a run
has measured. One amplitude gives the others: velocity omega A, acceleration omega^2 A.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from sandmould.scenario.vibration import STANDARD_GRAVITY_M_S2, VibrationStage

DISPLACEMENT, VELOCITY, ACCELERATION = (
    "drive_displacement_m", "drive_velocity_m_s", "drive_acceleration_g"
)  # fmt: skip
"""Columns of the amplitudes in tables."""
STEADY_SHARE = 0.5
"""Of a vibration, its end, that counts as steady."""


@dataclass(frozen=True)
class BoxDrive:
    """A sinusoidal motion of the box."""

    frequency_hz: float
    displacement_m: float
    """Amplitude: half of the stroke."""

    @property
    def velocity_m_s(self) -> float:
        """Amplitude of the velocity."""
        return 2 * math.pi * self.frequency_hz * self.displacement_m

    @property
    def acceleration_g(self) -> float:
        """Amplitude of the acceleration over 9.80665 m/s2."""
        omega = 2 * math.pi * self.frequency_hz
        return omega**2 * self.displacement_m / STANDARD_GRAVITY_M_S2

    def columns(self) -> dict[str, float]:
        """Amplitudes by the columns of tables."""
        return {
            DISPLACEMENT: self.displacement_m,
            VELOCITY: self.velocity_m_s,
            ACCELERATION: self.acceleration_g,
        }


def laid_down_drive(stage: VibrationStage) -> BoxDrive:
    """The motion at full amplitude of a stage that lays it down."""
    return BoxDrive(stage.frequency_hz, stage.amplitude_m)


def steady_drive(
    frequency_hz: float, displacement_m: NDArray[np.float64], phase_deg: NDArray[np.float64]
) -> BoxDrive:
    """The steady motion of a table on mounts.

    Parameters
    ----------
    frequency_hz : float
    displacement_m, phase_deg : (p,) float64, m and degrees
        Amplitude and lag of each period, at least one, in order.

    Returns
    -------
    BoxDrive
        Mean over the periods of the second half, phases included: what changes its phase from
        period to period is no motion of the drive's frequency.
    """
    first = int(len(displacement_m) * (1 - STEADY_SHARE))
    waves = displacement_m[first:] * np.exp(-1j * np.radians(phase_deg[first:]))
    return BoxDrive(frequency_hz, float(abs(waves.mean())))
