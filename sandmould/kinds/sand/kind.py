"""The kind of study that simulates sand."""

from __future__ import annotations

from typing import Literal

from pydantic import Field

from sandmould.definition.study import Study, kind_key
from sandmould.kinds.kind import Kind, opened_later
from sandmould.scenario.contact import BackgroundDamping, Contact
from sandmould.scenario.quantity import Section
from sandmould.scenario.sand import Sand
from sandmould.scenario.scenario import Scenario


class SandStudy(Study):
    """A study of sand."""

    kind: Literal["sand"] = kind_key("sand")
    scenario: Scenario = Field(
        Scenario(), description="Scene of sand: box, obstacles, fill, vibration."
    )


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
