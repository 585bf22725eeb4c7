"""The typed study: one scenario, what is swept over it, and what is asked of the runs."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from typing import TYPE_CHECKING, Annotated, Any, ClassVar

from pydantic import Field

from sandmould.bad_input import Problem
from sandmould.definition.certificate import RobustnessChecks
from sandmould.definition.refinement import Refinement
from sandmould.definition.sweep import Sweep
from sandmould.limits import REPLICATES
from sandmould.scenario.engine import EngineName
from sandmould.scenario.quantity import NAME, Section, quantity
from sandmould.scenario.sand import ARGUED
from sandmould.statistics.config import Calibration, Equivalence, Objective

if TYPE_CHECKING:
    from sandmould.statistics.answer import SweepEnd


class CrossCheck(Section):
    """Runs of one swept point again, on another engine; margins are those of equivalence."""

    engine: EngineName = quantity(..., "Engine that computes them.", source="user")
    at: dict[str, Any] = Field(
        {}, description="The swept point: a value of every swept key, as the sweep has it."
    )
    replicates: int | None = quantity(
        None,
        "Number of replicates, counted from the first; they share their seeds with the sweep's. "
        "All unless given.",
        source=ARGUED,
        ge=1,
    )
    vibration_s: float | None = quantity(
        None,
        "Duration of the last vibration in the runs of the check, if it is to be shorter. Both "
        "engines then compute runs of their own. That of the scenario unless given.",
        unit="s",
        source="user",
        gt=0,
    )


def kind_key(name: str) -> Any:
    """The key that says what is simulated, for the studies of one kind."""
    return quantity(name, "What is simulated; deck is a template of the user's own.", source=ARGUED)


class Study(Section):
    """One study: all of it can stand in one file, or rest on the file that based_on names.

    Each kind of study states its own ``kind`` and the type of its ``scenario``.
    """

    kind: str
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
    scenario: Any
    sweep: Sweep = Field(
        Sweep(),
        description="What is varied. It replaces the sweep of based_on together with its "
        "equivalence, rounds, certificate and cross_check.",
    )
    replicates: int = quantity(
        1,
        "Runs of every point; they differ only in where their grains start.",
        source=ARGUED,
        ge=1,
        le=REPLICATES.most,
    )
    own_measures: dict[Annotated[str, Field(pattern=NAME)], str] = Field(
        {},
        description="Measures of your own by name; the name ends in the unit. Each is a formula "
        "of other measures with numbers, + - * / **, brackets, min, max, abs and sqrt.",
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

    @property
    def adds_replicates(self) -> bool:
        """Whether rounds give more replicates to settings that may be the best."""
        return self.refine.rounds > 0 and self.refine.adds == "replicates"

    @property
    def grain_price_share(self) -> float:
        """Share of the sweep's price that its best settings may take with coarser grains."""
        return 0.0

    @property
    def decides_more(self) -> bool:
        """Whether runs may follow that only those of the sweep tell."""
        return bool(self.refine.rounds or self.certificate.controls or self.grain_price_share)

    @property
    def trusts_program(self) -> bool:
        """Whether the user lets its runs execute a program that is not shipped."""
        return False

    @property
    def more_folders(self) -> tuple[str, ...]:
        """Folders, seen from ROOT, that such a program's files may lie in beside its own."""
        return ()

    def table_limit(self, scenario: Any) -> str:
        """Key of the limit of the user's table that a setting lies beyond; empty where none."""
        return ""

    @property
    def table_limits(self) -> Mapping[str, float]:
        """Limits of the user's table that are stated, by key."""
        return {}

    def table_limit_at(self, end: SweepEnd) -> str:
        """Key of the limit that keeps the table from going beyond an end of the sweep."""
        return ""

    def problems(self) -> Iterable[Problem]:
        """What is wrong with the sections that only its kind has, where the sweep is sound."""
        return ()


class StudyBesideSand(Study):
    """A study of a kind that has none of the sections that change a scene of sand."""

    cross_check: ClassVar[CrossCheck | None] = None  # type: ignore[misc]
    certificate: ClassVar[RobustnessChecks] = RobustnessChecks()  # type: ignore[misc]
    calibration: ClassVar[Calibration] = Calibration()  # type: ignore[misc]


class CastingStudy(StudyBesideSand):
    """A study in which nothing is drawn by lot: a setting is one run."""

    replicates: ClassVar[int] = 1  # type: ignore[misc]
