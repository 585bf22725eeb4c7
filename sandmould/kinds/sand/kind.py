"""The kind of study that simulates sand."""

from __future__ import annotations

from collections.abc import Mapping
from typing import TYPE_CHECKING, Literal

from pydantic import Field

from sandmould.definition.study import Study, kind_key
from sandmould.definition.table import VibratingTable
from sandmould.kinds.kind import Kind, opened_later
from sandmould.scenario.contact import BackgroundDamping, Contact
from sandmould.scenario.drive import laid_down_drive
from sandmould.scenario.quantity import Section
from sandmould.scenario.sand import Sand
from sandmould.scenario.scenario import Scenario
from sandmould.scenario.vibration import VibrationStage
from sandmould.statistics.grain_check import FEWEST, GrainCheck

if TYPE_CHECKING:
    from sandmould.statistics.answer import SweepEnd


FARTHER = 1.1
"""Beyond an end of the sweep by this factor a table is asked whether it can go on: less is hardly
another setting (argued)."""


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
