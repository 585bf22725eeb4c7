"""The kind of study that simulates sand."""

from __future__ import annotations

from collections.abc import Mapping
from typing import TYPE_CHECKING, Literal, Self

from pydantic import Field, model_validator
from pydantic_core import PydanticCustomError

from sandmould.definition.study import Study, kind_key
from sandmould.kinds.kind import Kind, opened_later
from sandmould.scenario.contact import BackgroundDamping, Contact
from sandmould.scenario.drive import BoxDrive, laid_down_drive
from sandmould.scenario.quantity import Section, quantity
from sandmould.scenario.sand import Sand
from sandmould.scenario.scenario import Scenario
from sandmould.scenario.vibration import VibrationStage
from sandmould.statistics.grain_check import FEWEST, GrainCheck

if TYPE_CHECKING:
    from sandmould.statistics.answer import SweepEnd


ROUND_OFF = 1e-9
"""Share by which a setting at a limit may lie beyond it."""
FARTHER = 1.1
"""Beyond an end of the sweep by this factor a table is asked whether it can go on: less is hardly
another setting (argued)."""


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


class SandStudy(Study):
    """A study of sand."""

    kind: Literal["sand"] = kind_key("sand")
    scenario: Scenario = Field(
        Scenario(), description="Scene of sand: box, obstacles, fill, vibration."
    )
    table: VibratingTable = Field(
        VibratingTable(), description="What your table can do: settings beyond it are left out."
    )

    grain_check: GrainCheck = Field(
        GrainCheck(), description="What the size of the model's grains does, by runs of its own."
    )

    @property
    def grain_price_share(self) -> float:
        """See ``Study``."""
        scale = self.scenario.sand.size_scale
        enough = self.replicates >= FEWEST or self.adds_replicates
        asked = self.seeks_best and not self.calibration.sands
        swept = any(key.startswith("sand.") for key in self.sweep.swept)
        is_due = asked and enough and scale > 1.0 and not swept
        return self.grain_check.price_share if is_due else 0.0

    def table_limit(self, scenario: Scenario) -> str:
        """See ``Study``; a vibration during the fill counts too."""
        shakings = (*scenario.fill.shakings, *scenario.vibrations)
        limits = (self.table.limit_beyond(laid_down_drive(each)) for each in shakings)
        return next(filter(None, limits), "")

    @property
    def table_limits(self) -> Mapping[str, float]:
        """See ``Study``."""
        return self.table.model_dump(exclude_none=True)

    def table_limit_at(self, end: SweepEnd) -> str:
        """See ``Study``; of a swept number of a stage of vibration."""
        section, _, name = end.key.rpartition(".")
        number = section.removeprefix("vibration.")
        stages = dict(enumerate(self.scenario.vibration))
        stage = stages.get(int(number)) if number.isdecimal() else None
        if not isinstance(stage, VibrationStage):
            return ""
        farther = end.value * (FARTHER if end.is_highest else 1.0 / FARTHER)
        drive = laid_down_drive(stage.model_copy(update={name: farther}))
        return self.table.limit_beyond(drive)


class Material(Section):
    """A named sand: the part of a scenario that a material file may state."""

    sand: Sand = Field(Sand(), description="Grains: sieve curve, density, size in the model.")
    contact: Contact = Field(Contact(), description="Contact laws: springs, friction, damping.")
    background_damping: BackgroundDamping = Field(
        BackgroundDamping(), description="Damping of free grains."
    )


SAND: Kind[Scenario] = Kind(
    name="sand",
    scenario=Scenario,
    study=SandStudy,
    open_planning=opened_later("sandmould.kinds.sand.planning", "SandPlanning"),
    open_execution=opened_later("sandmould.kinds.sand.execution", "SandExecution"),
    material=Material,
    draws_by_lot=True,
    labels_have_units=False,
)
