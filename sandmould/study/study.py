"""The typed study: one scenario, what is swept over it, and what is asked of the runs."""

from __future__ import annotations

from typing import Any, Literal

from pydantic import Field

from sandmould.scenario.contact import BackgroundDamping, Contact
from sandmould.scenario.flow import MetalFlow
from sandmould.scenario.own_deck import OwnDeck
from sandmould.scenario.quantity import NAME, Section, quantity
from sandmould.scenario.sand import ARGUED, Sand
from sandmould.scenario.scenario import Scenario
from sandmould.scenario.solidification import MetalAndMould, Solidification
from sandmould.statistics.calibration.config import Calibration
from sandmould.statistics.config import Equivalence, Objective
from sandmould.study.robustness.config import RobustnessChecks
from sandmould.study.rounds.config import Refinement
from sandmould.study.sweep import Sweep


class CrossCheck(Section):
    """Runs of one swept point again, on another engine; margins are those of equivalence."""

    engine: Literal["lammps", "liggghts", "reference"] = quantity(
        ..., "Engine that computes them.", source="user"
    )
    at: dict[str, Any] = Field(
        {}, description="The swept point: a value of every swept key, as the sweep has it."
    )
    replicates: int | None = quantity(
        None,
        "The first so many replicates, which share their seeds with the sweep's; all unless given.",
        source=ARGUED,
        ge=1,
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

    kind: Literal["sand", "deck", "solidification", "flow"] = quantity(
        "sand", "What is simulated; deck is a template of the user's own.", source=ARGUED
    )
    title: str = quantity("", "The question in one line, head of the report.", source="user")
    based_on: str | None = quantity(
        None, "Study or shipped scenario that this one changes.", source="user", pattern=NAME
    )
    material: str | None = quantity(
        None,
        "Materials of config/materials that the scenario starts from.",
        source="user",
        pattern=NAME,
    )
    scenario: Scenario = Field(Scenario(), description="The scene of sand.")
    sweep: Sweep = Field(
        Sweep(),
        description="What is varied; replaces the sweep of based_on, its equivalence, its rounds, "
        "its certificate and its cross_check.",
    )
    replicates: int = quantity(
        1,
        "Runs of every point, alike but for the grains' starting places.",
        source=ARGUED,
        ge=1,
        le=1000,
    )
    objective: Objective = Field(Objective(), description="What makes a setting the best.")
    equivalence: Equivalence = Field(
        Equivalence(), description="Which settings should agree within margins."
    )
    cross_check: CrossCheck | None = Field(
        None, description="One point of the sweep computed on another engine too."
    )
    refine: Refinement = Field(
        Refinement(),
        description="Rounds of further runs round the optimum; replaced with the sweep.",
    )
    certificate: RobustnessChecks = Field(
        RobustnessChecks(),
        description="Controls round the best frequency; replaced with the sweep.",
    )
    calibration: Calibration = Field(
        Calibration(), description="Sands whose swept keys are found from measured values."
    )

    @property
    def seeks_best(self) -> bool:
        """Whether the study looks for the best setting, not for agreement or for a value."""
        return not self.equivalence.keys and self.objective.better != "neither"


class DeckStudy(Study):
    """A study of a deck of the user's own."""

    scenario: OwnDeck = Field(  # type: ignore[assignment]
        ..., description="What the template is given, and what is read from its log."
    )


class SolidificationStudy(Study):
    """A study of a casting in its mould."""

    scenario: Solidification = Field(  # type: ignore[assignment]
        ..., description="The casting, its mould, and how they are computed."
    )
    reference: dict[str, Any] = Field(
        {},
        description="The swept point that the others are compared with in error and cost: a value "
        "of every swept key, as the sweep has it.",
    )


class FlowStudy(Study):
    """A study of metal that flows."""

    scenario: MetalFlow = Field(  # type: ignore[assignment]
        ..., description="The metal, where it flows, and how that is computed."
    )


ONLY_SAND = ("cross_check", "calibration", "certificate")
"""Sections that other kinds of studies do not have."""
_MODELS: dict[str, type[Study]] = {
    "deck": DeckStudy, "solidification": SolidificationStudy, "flow": FlowStudy
}  # fmt: skip
_MATERIALS: dict[str, type[Section]] = {"sand": Material, "solidification": MetalAndMould}


def study_model(kind: str) -> type[Study]:
    """Type of the studies of a kind."""
    return _MODELS.get(kind, Study)


def material_model(kind: str) -> type[Section] | None:
    """What a material file holds for a kind of studies; None where they have none."""
    return _MATERIALS.get(kind)
