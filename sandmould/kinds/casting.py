"""What kinds of casting have in common: solvers of our own, which take a whole scenario."""

from __future__ import annotations

from abc import abstractmethod
from collections.abc import Callable
from pathlib import Path
from typing import TYPE_CHECKING, Any, Protocol

import numpy as np

from sandmould.definition.run import LAST_MEASURED, PICTURE, Run
from sandmould.kinds.kind import Execution, Planning, ScenarioT
from sandmould.runs.files import replaced
from sandmould.runs.products import Computed, Cost

if TYPE_CHECKING:
    import pandas as pd
    from matplotlib.axes import Axes


class CastingSolver(Protocol):
    """What a module that computes runs offers."""

    def source_files(self) -> list[Path]:
        """Files of the solver."""

    def source_hash(self) -> str:
        """State of the solver."""

    def no_cost(self, scenario: Any) -> Cost:
        """Cost of a run that has not begun."""

    def compute(self, scenario: Any, folder: Path, run: str) -> Computed:
        """Compute a run."""

    def complete(self, scenario: Any, work: Path) -> None:
        """Make the products that a broken run never wrote."""


class CastingPlanning(Planning[ScenarioT]):
    """How runs are planned whose solver is our own; their measures are those of the end."""

    measuring: tuple[str, ...] = ("sandmould/kinds/casting.py",)

    @property
    @abstractmethod
    def solver(self) -> CastingSolver:
        """The module that computes them."""

    def sources(self, scenario: ScenarioT) -> list[Path]:
        """Files of the solver."""
        return self.solver.source_files()

    def template_hash(self, scenario: ScenarioT) -> str:
        """State of the solver."""
        return self.solver.source_hash()


class CastingExecution(Execution[ScenarioT]):
    """How a solver of our own computes runs."""

    @property
    @abstractmethod
    def solver(self) -> CastingSolver:
        """The module that computes them."""

    def compute(self, run: Run, folder: Path) -> Computed:
        """Have the solver compute a run."""
        return self.solver.compute(run.scenario, folder, run.run)

    def complete(self, scenario: ScenarioT, work: Path) -> None:
        """Have the solver make what is missing."""
        self.solver.complete(scenario, work)

    def no_cost(self, scenario: ScenarioT) -> Cost:
        """As the solver states it."""
        return self.solver.no_cost(scenario)


def read_fields(folder: Path) -> dict[str, Any] | None:
    """Arrays of ``fields.npz``; None where the run broke off before it wrote them."""
    path = folder / "fields.npz"
    if not path.exists():
        return None
    with np.load(path, allow_pickle=False) as arrays:
        return dict(arrays)


def write_measures(folder: Path, table: pd.DataFrame) -> None:
    """Write the measures of a run."""
    with replaced(folder / LAST_MEASURED) as partial:
        table.to_csv(partial, sep="\t", index=False, float_format="%.10g")


def write_picture(
    folder: Path, size_inches: tuple[float, float], draw: Callable[[Axes], None] | None
) -> None:
    """Write the picture of a run's end; without fields to draw it says so."""
    from matplotlib.figure import Figure

    figure = Figure(figsize=size_inches, dpi=150, layout="constrained")
    if draw:
        draw(figure.subplots())
    else:
        figure.text(0.5, 0.5, "No fields: the run broke off.", ha="center")
    figure.savefig(folder / PICTURE)
