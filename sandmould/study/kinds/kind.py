"""What a study asks of the kind of thing that it simulates."""

from __future__ import annotations

import importlib
from collections.abc import Mapping
from pathlib import Path
from typing import Any, Protocol, cast

from sandmould.runs.products import Computed, Cost
from sandmould.scenario.bad_input import Problem
from sandmould.scenario.flow import MetalFlow
from sandmould.scenario.own_deck import OwnDeck
from sandmould.scenario.quantity import Section
from sandmould.scenario.scenario import Scenario
from sandmould.scenario.solidification import Solidification
from sandmould.study.definition.run import Run

AnyScenario = Scenario | OwnDeck | Solidification | MetalFlow
SpeedClass = tuple[str, int]
"""Engine and dimension: what the speed of a core depends on most."""


class Kind(Protocol):
    """What ``sandmould.study.kinds.<kind>`` offers, for each kind."""

    MODEL: type[Section]
    """Type of its scenario."""
    WORK: str
    """Unit of ``planned_work``."""
    PRODUCTS: tuple[str, ...]
    """What a run leaves beside outcome, cost and provenance."""

    @staticmethod
    def defaults() -> dict[str, Any]:
        """Scenario of a study that states nothing."""

    @staticmethod
    def resolved(scenario: Any) -> Any:
        """The scenario with the hashes of the files that it names."""

    @staticmethod
    def problems(scenario: Any) -> list[Problem]:
        """What keeps a well-typed scenario from being run."""

    @staticmethod
    def lasts_s(scenario: Any) -> float:
        """Time of vibration, over which measures are taken."""

    @staticmethod
    def engine_problem(scenario: Any) -> Problem | None:
        """Why this machine cannot compute it."""

    @staticmethod
    def sources(scenario: Any) -> list[Path]:
        """Files that its runs are computed again for when they change."""

    @staticmethod
    def template_hash(scenario: Any) -> str:
        """Hash of all that turns a scenario into a deck, and of our solver where it takes part."""

    @staticmethod
    def computed_hash(scenario: Any) -> str:
        """Hash of what is computed, whatever it is called."""

    @staticmethod
    def threads(scenario: Any) -> int:
        """Cores that a run keeps busy, as MPI ranks or as threads."""

    @staticmethod
    def ranks(scenario: Any) -> int:
        """MPI ranks of a run."""

    @staticmethod
    def memory_mb(scenario: Any) -> int:
        """Memory to ask for."""

    @staticmethod
    def allowed_s(scenario: Any) -> float:
        """Wall time to ask for, less what any job takes."""

    @staticmethod
    def planned_work(scenario: Any) -> float:
        """What a run costs, before it starts."""

    @staticmethod
    def predicted_s(scenario: Any) -> float:
        """Wall time of a run at speeds that are the same on every machine."""

    @staticmethod
    def planned_s(scenario: Any) -> float:
        """Simulated time of a whole run."""

    @staticmethod
    def speed_class(scenario: Any) -> SpeedClass:
        """Scenarios of one class are computed at one speed."""

    @staticmethod
    def rate(scenario: Any, results: Path) -> float | None:
        """Work a second of one core of this machine; None where it cannot be known."""

    @staticmethod
    def plan_cells(scenario: Any) -> Mapping[str, str]:
        """What the plan tells of a run, by heading."""

    @staticmethod
    def render(run: Run, folder: Path) -> None:
        """Write the deck of a run into its folder."""

    @staticmethod
    def compute(run: Run, folder: Path) -> Computed:
        """Compute a run from its newest checkpoint, or from its beginning."""

    @staticmethod
    def complete(scenario: Any, work: Path) -> None:
        """Make the products in a work folder that a broken run never wrote."""

    @staticmethod
    def no_cost(scenario: Any) -> Cost:
        """Cost of a run that has not begun."""

    @staticmethod
    def measure(run: Run, folder: Path) -> None:
        """Measure what a run left behind; the picture last."""


_MODULE_OF = {
    Scenario: "sand", OwnDeck: "deck", Solidification: "solidification", MetalFlow: "flow"
}  # fmt: skip


def kind_named(name: str) -> Kind:
    """The kind of a study by its name in the study's file."""
    return cast(Kind, importlib.import_module(f"sandmould.study.kinds.{name}.planning"))


def kind_of(scenario: AnyScenario) -> Kind:
    """The kind that a scenario belongs to."""
    return kind_named(_MODULE_OF[type(scenario)])
