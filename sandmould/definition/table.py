"""What a vibrating table can do: settings beyond it are not computed."""

from __future__ import annotations

from typing import Self

from pydantic import model_validator
from pydantic_core import PydanticCustomError

from sandmould.scenario.drive import BoxDrive
from sandmould.scenario.quantity import Section, quantity

ROUND_OFF = 1e-9
"""Share by which a setting at a limit may lie beyond it."""


class VibratingTable(Section):
    """Limits of the table that a study is for; what is not given does not limit it.

    A table with an unbalance is judged by how it moves without sand.
    """

    lowest_frequency_hz: float | None = quantity(
        None, "Lowest frequency of its motors.", unit="Hz", source="user", gt=0, le=10000
    )
    highest_frequency_hz: float | None = quantity(
        None,
        "Highest frequency of its motors: the speed on their plate in rpm, divided by 60.",
        unit="Hz",
        source="user",
        gt=0,
        le=10000,
    )
    largest_displacement_m: float | None = quantity(
        None,
        "Largest amplitude: half of the stroke from end to end.",
        unit="m",
        source="user",
        gt=0,
        le=0.1,
    )
    largest_velocity_m_s: float | None = quantity(
        None, "Largest amplitude of the velocity.", unit="m/s", source="user", gt=0, le=10
    )
    largest_acceleration_g: float | None = quantity(
        None,
        "Largest amplitude of the acceleration over 9.80665 m/s2.",
        unit="g",
        source="user",
        gt=0,
        le=100,
    )

    @model_validator(mode="after")
    def _order(self) -> Self:
        low, high = self.lowest_frequency_hz, self.highest_frequency_hz
        if low is not None and high is not None and low > high:
            raise PydanticCustomError(
                "table", "a lowest_frequency_hz of at most highest_frequency_hz"
            )
        return self

    def limit_beyond(self, drive: BoxDrive) -> str:
        """Key of the first limit that a motion lies beyond; empty where the table can do it."""
        most = {
            "highest_frequency_hz": drive.frequency_hz,
            "largest_displacement_m": drive.displacement_m,
            "largest_velocity_m_s": drive.velocity_m_s,
            "largest_acceleration_g": drive.acceleration_g,
        }
        low = self.lowest_frequency_hz
        if low is not None and drive.frequency_hz < low * (1.0 - ROUND_OFF):
            return "lowest_frequency_hz"
        for key, value in most.items():
            limit = getattr(self, key)
            if limit is not None and value > limit * (1.0 + ROUND_OFF):
                return key
        return ""
