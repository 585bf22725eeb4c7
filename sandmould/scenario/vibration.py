"""Vibration of the moulding box: one sinusoid a stage, what is held constant, its start and stop.

The box moves as s(t) = A R(t) sin(2 pi f t) from the start of the stage, with R rising to 1 and
falling to 0 over the ramp at either end. A stage lasts a whole number of periods, so the box
ends where it began and the next stage needs no jump.

Where the sand comes to rest after a stage without a ramp, the box stops smoothly: once the stage
is over the sinusoid goes on, and its amplitude falls as (1 + cos(pi t / t_stop)) / 2. Neither the
place nor the velocity of the box jumps at either end of the stop, at whatever phase it begins.

With ``hold: unbalance`` the same sinusoid is the force of rotating masses instead, and the table's
motion follows from it (``sandmould.scenario.unbalance``).
"""

from __future__ import annotations

import math
from typing import Annotated, Any, Literal, Self

import numpy as np
from numpy.typing import NDArray
from pydantic import Discriminator, Field, Tag, model_validator
from pydantic_core import PydanticCustomError

from sandmould.scenario.quantity import Section, quantity
from sandmould.scenario.sand import ARGUED
from sandmould.scenario.unbalance import Unbalance

STANDARD_GRAVITY_M_S2 = 9.80665
"""The 'g' of an acceleration_g (CGPM 1901), whatever gravity the scene has."""
TUBE_PAPER = "Rojek 2004, section 4.2"
STOP_PERIODS = 1.0
"""Periods in which the box stops: in a half one it would be accelerated 1.4 times as hard as by the
vibration, in one 1.05 times; a longer stop goes on shaking the sand
(docs/developers/measured_at_rest.md)."""


class Shaking(Section):
    """How the box vibrates: direction, frequency and amplitude."""

    direction: Literal["vertical", "horizontal"] | tuple[float, ...] = quantity(
        "vertical", "Direction of the box motion: a word or a vector.", source=TUBE_PAPER
    )
    frequency_hz: float = quantity(
        50.0, "Frequency.", unit="Hz", source=TUBE_PAPER, ge=0.1, le=10000
    )
    hold: Literal["acceleration", "velocity", "displacement", "unbalance"] = quantity(
        "acceleration",
        "Which amplitude stays the same when the frequency changes. unbalance: the rotating "
        "masses stay the same. The table's motion is then computed from them, from its mounts and "
        "from the sand.",
        source=ARGUED,
    )
    unbalance: Unbalance | None = Field(
        None, description="Table and rotating masses, with hold unbalance alone."
    )
    acceleration_g: float | None = quantity(
        None, "Acceleration amplitude over 9.80665 m/s2.", unit="g", source=TUBE_PAPER, gt=0, le=100
    )
    velocity_m_s: float | None = quantity(
        None, "Velocity amplitude.", unit="m/s", source=ARGUED, gt=0, le=10
    )
    displacement_m: float | None = quantity(
        None,
        "Amplitude of the displacement, half of peak to peak.",
        unit="m",
        source=ARGUED,
        gt=0,
        le=0.1,
    )
    reference_frequency_hz: float | None = quantity(
        None,
        "Frequency at which a given amplitude of another kind than the held one applies.",
        unit="Hz",
        source=ARGUED,
        ge=0.1,
        le=10000,
    )

    @model_validator(mode="after")
    def _one_amplitude(self) -> Self:
        given = self._given()
        if self.hold == "unbalance":
            self._unbalance_alone()
        elif self.unbalance is not None:
            raise PydanticCustomError("unbalance", "no section unbalance, or hold: unbalance")
        elif len(given) != 1:
            raise PydanticCustomError(
                "amplitude",
                "exactly one of acceleration_g, velocity_m_s and displacement_m",
            )
        elif given[0] != self.hold and self.reference_frequency_hz is None:
            raise PydanticCustomError(
                "amplitude",
                "an amplitude of the kind that hold names, or reference_frequency_hz beside it",
            )
        if not isinstance(self.direction, str) and not any(self.direction):
            raise PydanticCustomError("direction", "a direction vector that is not zero")
        return self

    def _unbalance_alone(self) -> None:
        if self.unbalance is None:
            raise PydanticCustomError(
                "unbalance",
                "a section unbalance with moment_kg_m, moving_mass_kg and mount_frequency_hz",
            )
        if self._given() or self.reference_frequency_hz is not None:
            raise PydanticCustomError(
                "unbalance",
                "none of acceleration_g, velocity_m_s, displacement_m and reference_frequency_hz "
                "with hold unbalance: the table's motion is computed",
            )

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
        """Displacement amplitude A at this stage's frequency; with an unbalance, without sand."""
        if self.unbalance is not None:
            return self.unbalance.empty_amplitude_m(self.angular_frequency_rad_s)
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


class VibrationStage(Shaking):
    """One stage of vibration at one frequency."""

    kind: Literal["vibrate"] = "vibrate"
    duration_s: float = quantity(
        1.0, "Duration, rounded to whole periods.", unit="s", source=ARGUED, gt=0, le=3600
    )
    ramp_s: float = quantity(
        0.0, "Time to reach and to leave full amplitude.", unit="s", source=ARGUED, ge=0
    )

    @model_validator(mode="after")
    def _short_ramp(self) -> VibrationStage:
        if 2 * self.ramp_s > self.duration_s:
            raise PydanticCustomError("ramp", "a ramp_s of at most half the duration_s")
        return self

    @property
    def whole_duration_s(self) -> float:
        """Duration rounded to a whole number of periods, at least one."""
        return max(1, round(self.duration_s * self.frequency_hz)) / self.frequency_hz

    @property
    def stop_s(self) -> float:
        """Time in which the box stops once the stage is over; 0 of a stage that has a ramp."""
        return 0.0 if self.ramp_s > 0 else STOP_PERIODS / self.frequency_hz

    def displacements_at(
        self, time_s: NDArray[np.float64], stops_smoothly: bool = False
    ) -> NDArray[np.float64]:
        """Displacement s(t) along the direction, m.

        Zero before the stage, and once the box has stopped. ``time_s``: since the stage began.
        ``stops_smoothly``: whether the box stops smoothly after the stage, or dead at its end.
        """
        return self._waves(self.amplitude_m, time_s, stops_smoothly)

    def unbalance_forces_at(
        self, time_s: NDArray[np.float64], stops_smoothly: bool = False
    ) -> NDArray[np.float64]:
        """Force of the rotating masses along the direction, N; see ``displacements_at``.

        The masses are turned against each other in the time in which a box would stop.
        """
        assert self.unbalance is not None
        force_n = self.unbalance.force_n(self.angular_frequency_rad_s)
        return self._waves(force_n, time_s, stops_smoothly)

    def _waves(
        self, scale: float, time_s: NDArray[np.float64], stops_smoothly: bool
    ) -> NDArray[np.float64]:
        """The sinusoid of an amplitude with its ramps, or with its stop."""
        end, stop_s = self.whole_duration_s, self.stop_s if stops_smoothly else 0.0
        amplitude = np.full_like(time_s, scale)
        if self.ramp_s > 0:
            amplitude *= np.minimum(1.0, np.minimum(time_s, end - time_s) / self.ramp_s)
        elif stop_s > 0:
            amplitude *= 0.5 + 0.5 * np.cos(np.pi * np.maximum(0.0, time_s - end) / stop_s)
        moving = (time_s > 0) & (time_s < end + stop_s)
        wave = amplitude * np.sin(self.angular_frequency_rad_s * time_s)
        return np.where(moving, wave, 0.0)


class RestStage(Section):
    """A stage in which the box stands and the sand comes to rest, as after a layer of the fill."""

    kind: Literal["rest"]
    longest_s: float = quantity(
        2.0,
        "Sand that is not at rest so long after the box has stopped ends the run.",
        unit="s",
        source=ARGUED,
        gt=0,
        le=1000,
    )


def _kind_of(entry: Any) -> Any:
    """Kind of an entry of the list: one that names none vibrates."""
    if isinstance(entry, dict):
        return entry.get("kind", "vibrate")
    return getattr(entry, "kind", "vibrate")


BoxStage = Annotated[
    Annotated[VibrationStage, Tag("vibrate")] | Annotated[RestStage, Tag("rest")],
    Discriminator(_kind_of),
]
"""What the box does in a stage after the fill."""
