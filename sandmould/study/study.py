"""The typed study: one scenario, what is swept over it, and what is asked of the runs."""

from __future__ import annotations

from typing import Literal

from pydantic import Field

from sandmould.scenario.contact import BackgroundDamping, Contact
from sandmould.scenario.quantity import Section, quantity
from sandmould.scenario.sand import ARGUED, Sand
from sandmould.scenario.scenario import Scenario
from sandmould.study.sweep import Sweep

NAME = r"^[a-z][a-z0-9_]*$"
"""Pattern of the names of studies, scenarios and materials: their file's stem."""


class Objective(Section):
    """What makes one setting better than another."""

    measure: str = quantity(
        "tube_fill_fraction",
        "Column of measures.tsv that is compared.",
        source=ARGUED,
        pattern=NAME,
    )
    better: Literal["larger", "smaller"] = quantity(
        "larger", "Which values of the measure are better.", source=ARGUED
    )
    at_vibration_s: float | None = quantity(
        None,
        "Time of vibration at which the measure is taken; its end unless given.",
        unit="s",
        source=ARGUED,
        ge=0,
    )


class Material(Section):
    """A named sand: the part of a scenario that a material file may state."""

    sand: Sand = Field(Sand(), description="The sand.")
    contact: Contact = Field(Contact(), description="Contact laws.")
    background_damping: BackgroundDamping = Field(
        BackgroundDamping(), description="Damping of free grains."
    )


class Study(Section):
    """One study: all of it can stand in one file, or rest on the file that based_on names."""

    kind: Literal["sand", "solidification", "flow"] = quantity(
        "sand", "What is simulated.", source=ARGUED
    )
    title: str = quantity("", "The question in one line, head of the report.", source="user")
    based_on: str | None = quantity(
        None, "Study or shipped scenario that this one changes.", source="user", pattern=NAME
    )
    material: str | None = quantity(
        None, "Sand of config/materials that the scenario starts from.", source="user", pattern=NAME
    )
    scenario: Scenario = Field(Scenario(), description="The scene of sand.")
    sweep: Sweep = Field(Sweep(), description="What is varied; replaces the sweep of based_on.")
    replicates: int = quantity(
        1,
        "Runs of every point, alike but for the grains' starting places.",
        source=ARGUED,
        ge=1,
        le=1000,
    )
    objective: Objective = Field(Objective(), description="What makes a setting the best.")
