"""Vibration of the moulding box: one sinusoid a stage, what is held constant, and its start.

The box moves as s(t) = A R(t) sin(2 pi f t) from the start of the stage, with R rising to 1 and
falling to 0 over the ramp at either end. A stage lasts a whole number of periods, so the box
ends where it began and the next stage needs no jump.
"""

from __future__ import annotations

import math
from typing import Literal

import numpy as np
from numpy.typing import NDArray
from pydantic import model_validator
from pydantic_core import PydanticCustomError

from sandmould.scenario.quantity import Section, quantity
from sandmould.scenario.sand import ARGUED

STANDARD_GRAVITY_M_S2 = 9.80665
"""The 'g' of an acceleration_g (CGPM 1901), whatever gravity the scene has."""
TUBE_PAPER = "Rojek 2004, section 4.2"


class VibrationStage(Section):
    """One stage of vibration at one frequency."""

    direction: Literal["vertical", "horizontal"] | tuple[float, ...] = quantity(
        "vertical", "Direction of the box motion: a word or a vector.", source=TUBE_PAPER
    )
    frequency_hz: float = quantity(
        50.0, "Frequency.", unit="Hz", source=TUBE_PAPER, ge=0.1, le=10000
    )
    hold: Literal["acceleration", "velocity", "displacement"] = quantity(
        "acceleration", "Which amplitude stays the same when the frequency changes.", source=ARGUED
    )
    acceleration_g: float | None = quantity(
        None, "Acceleration amplitude over 9.80665 m/s2.", unit="g", source=TUBE_PAPER, gt=0, le=100
    )
    velocity_m_s: float | None = quantity(
        None, "Velocity amplitude.", unit="m/s", source=ARGUED, gt=0, le=10
    )
    displacement_m: float | None = quantity(
        None, "Displacement amplitude.", unit="m", source=ARGUED, gt=0, le=0.1
    )
    reference_frequency_hz: float | None = quantity(
        None,
        "Frequency at which a given amplitude of another kind than the held one applies.",
        unit="Hz",
        source=ARGUED,
        ge=0.1,
        le=10000,
    )
    duration_s: float = quantity(
        1.0, "Duration, rounded to whole periods.", unit="s", source=ARGUED, gt=0, le=3600
    )
    ramp_s: float = quantity(
        0.0, "Time to reach and to leave full amplitude.", unit="s", source=ARGUED, ge=0
    )

    @model_validator(mode="after")
    def _one_amplitude(self) -> VibrationStage:
        given = self._given()
        if len(given) != 1:
            raise PydanticCustomError(
                "amplitude",
                "exactly one of acceleration_g, velocity_m_s and displacement_m",
            )
        if given[0] != self.hold and self.reference_frequency_hz is None:
            raise PydanticCustomError(
                "amplitude",
                "an amplitude of the kind that hold names, or reference_frequency_hz beside it",
            )
        if 2 * self.ramp_s > self.duration_s:
            raise PydanticCustomError("ramp", "a ramp_s of at most half the duration_s")
        if not isinstance(self.direction, str) and not any(self.direction):
            raise PydanticCustomError("direction", "a direction vector that is not zero")
        return self

    def _given(self) -> list[str]:
        values = {
            "acceleration": self.acceleration_g,
            "velocity": self.velocity_m_s,
            "displacement": self.displacement_m,
        }
        return [name for name, value in values.items() if value is not None]

    @property
    def angular_frequency_rad_s(self) -> float:
        """2 pi f."""
        return 2 * math.pi * self.frequency_hz

    @property
    def amplitude_m(self) -> float:
        """Displacement amplitude A at this stage's frequency."""
        kind = self._given()[0]
        order = {"acceleration": 2, "velocity": 1, "displacement": 0}
        value = {
            "acceleration": (self.acceleration_g or 0.0) * STANDARD_GRAVITY_M_S2,
            "velocity": self.velocity_m_s or 0.0,
            "displacement": self.displacement_m or 0.0,
        }[kind]
        reference = self.angular_frequency_rad_s
        if kind != self.hold:
            reference = 2 * math.pi * (self.reference_frequency_hz or 0.0)
        held = value * reference ** (order[self.hold] - order[kind])
        return held / self.angular_frequency_rad_s ** order[self.hold]

    @property
    def peak_acceleration_g(self) -> float:
        """A omega^2 over 9.80665 m/s2."""
        return self.amplitude_m * self.angular_frequency_rad_s**2 / STANDARD_GRAVITY_M_S2

    @property
    def whole_duration_s(self) -> float:
        """Duration rounded to a whole number of periods, at least one."""
        return max(1, round(self.duration_s * self.frequency_hz)) / self.frequency_hz

    def unit_direction(self, dimension: int) -> tuple[float, ...]:
        """Direction as a unit vector of the scene's dimension."""
        if self.direction == "vertical":
            vector = (0.0,) * (dimension - 1) + (1.0,)
        elif self.direction == "horizontal":
            vector = (1.0,) + (0.0,) * (dimension - 1)
        else:
            vector = tuple(float(x) for x in self.direction)
        length = math.hypot(*vector)
        return tuple(x / length for x in vector)

    def displacements_at(self, time_s: NDArray[np.float64]) -> NDArray[np.float64]:
        """s(t) along the direction, m; zero before and after the stage."""
        end = self.whole_duration_s
        ramp = np.ones_like(time_s)
        if self.ramp_s > 0:
            ramp = np.minimum(1.0, np.minimum(time_s, end - time_s) / self.ramp_s)
        moving = (time_s > 0) & (time_s < end)
        wave = self.amplitude_m * ramp * np.sin(self.angular_frequency_rad_s * time_s)
        return np.where(moving, wave, 0.0)

    def displacement_at(self, time_s: float) -> float:
        """s(t) along the direction, m; zero before and after the stage."""
        return float(self.displacements_at(np.array(time_s)))
