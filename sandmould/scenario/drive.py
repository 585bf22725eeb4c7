"""How hard a box is shaken: amplitudes of its motion at the frequency of its drive.

Of a motion that is laid down they follow from its formula, of a table on mounts from what a run
has measured. One amplitude gives the others: velocity omega A, acceleration omega^2 A.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from sandmould.scenario.vibration import STANDARD_GRAVITY_M_S2, Shaking, VibrationStage

DISPLACEMENT, VELOCITY, ACCELERATION = (
    "drive_displacement_m", "drive_velocity_m_s", "drive_acceleration_g"
)  # fmt: skip
"""Columns of the amplitudes in tables."""
STEADY_SHARE = 0.5
"""Of a vibration between its ramps, its end, that counts as steady."""


@dataclass(frozen=True)
class BoxDrive:
    """A sinusoidal motion of the box."""

    frequency_hz: float
    displacement_m: float
    """Amplitude: half of peak to peak."""

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


def laid_down_drive(stage: Shaking) -> BoxDrive:
    """The motion at full amplitude of what lays it down; of a table on mounts, without sand."""
    return BoxDrive(stage.frequency_hz, stage.amplitude_m)


def steady_drive(
    stage: VibrationStage, displacement_m: NDArray[np.float64], phase_deg: NDArray[np.float64]
) -> BoxDrive | None:
    """The steady motion of a table on mounts.

    Mean over the second half of the periods between the ramps, phases included: what changes its
    phase from period to period is no motion of the drive's frequency. None where no period so far
    had the full moment. ``displacement_m``, ``phase_deg``, (p,) float64, m and degrees: amplitude
    and lag of each period of the stage so far, from its first on.
    """
    ramp = stage.ramp_s * stage.frequency_hz
    begin = np.arange(len(displacement_m))
    # a ramp may end with a period but for round-off
    last = stage.whole_duration_s * stage.frequency_hz - ramp - 1 + 1e-9
    full = np.flatnonzero((begin >= ramp - 1e-9) & (begin <= last))
    if not len(full):
        return None
    steady = full[int(len(full) * (1 - STEADY_SHARE)) :]
    waves = displacement_m[steady] * np.exp(-1j * np.radians(phase_deg[steady]))
    return BoxDrive(stage.frequency_hz, float(abs(waves.mean())))
