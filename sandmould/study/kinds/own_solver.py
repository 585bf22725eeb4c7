"""What studies of casting have in common: our own solvers, which are given a whole scenario."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any, Protocol

import numpy as np
import pandas as pd

from sandmould.runs.files import replaced, write_text
from sandmould.runs.products import Computed, Cost
from sandmould.scenario.bad_input import Problem
from sandmould.scenario.quantity import Section
from sandmould.study.moments import LAST_MEASURED
from sandmould.study.run import Run

if TYPE_CHECKING:
    from matplotlib.axes import Axes

SLOWER = 10.0
"""Than predicted a machine may be, and a run longer than expected."""


class Solver(Protocol):
    """What a module that computes runs offers."""

    def source_files(self) -> list[Path]:
        """Files of the solver."""

    def source_hash(self) -> str:
        """State of the solver."""

    def computed_hash(self, scenario: Any) -> str:
        """Hash of scenario and solver."""

    def no_cost(self, scenario: Any) -> Cost:
        """Cost of a run that has not begun."""

    def compute(self, scenario: Any, folder: Path, run: str) -> Computed:
        """Compute a run."""

    def complete(self, scenario: Any, work: Path) -> None:
        """Make the products that a broken run never wrote."""


@dataclass(frozen=True)
class Given:
    """Entries of a kind whose solver takes a whole scenario."""

    solver: Solver
    problems: Callable[[Any], list[Problem]]
    predicted_s: Callable[[Any], float]

    def defaults(self) -> dict[str, Any]:
        """Nothing: what is cast is the user's."""
        return {}

    def lasts_s(self, scenario: Section) -> float:
        """Measures are those of the end."""
        return 0.0

    def engine_problem(self, scenario: Section) -> Problem | None:
        """None: the solver is our own."""
        return None

    def ranks(self, scenario: Section) -> int:
        """No MPI."""
        return 1

    def sources(self, scenario: Section) -> list[Path]:
        """Our solver."""
        return self.solver.source_files()

    def template_hash(self, scenario: Section) -> str:
        """Hash of our solver."""
        return self.solver.source_hash()

    def computed_hash(self, scenario: Section) -> str:
        """Hash of scenario and solver."""
        return self.solver.computed_hash(scenario)

    def no_cost(self, scenario: Section) -> Cost:
        """Cost of a run that has not begun."""
        return self.solver.no_cost(scenario)

    def allowed_s(self, scenario: Section) -> float:
        """Wall time on a slow machine."""
        return SLOWER * self.predicted_s(scenario)

    def render(self, run: Run, folder: Path) -> None:
        """Write down all that the solver is given, each value with its source."""
        _write_given(run, folder, self.solver.source_hash())

    def compute(self, run: Run, folder: Path) -> Computed:
        """Compute a run from its newest checkpoint, or from its beginning."""
        return self.solver.compute(run.scenario, folder, run.run)

    def complete(self, scenario: Section, work: Path) -> None:
        """Make the products that a broken run never wrote."""
        self.solver.complete(scenario, work)


def read_fields(folder: Path) -> dict[str, Any] | None:
    """Arrays of ``fields.npz``; None where the run broke off before it wrote them."""
    path = folder / "fields.npz"
    if not path.exists():
        return None
    with np.load(path) as kept:
        return dict(kept)


def write_measures(folder: Path, table: pd.DataFrame) -> None:
    """Write the measures of a run."""
    with replaced(folder / "measures.tsv") as partial:
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
    figure.savefig(folder / LAST_MEASURED)


def _write_given(run: Run, folder: Path, solver: str) -> None:
    """Write every value of a run's scenario with its source to ``deck.in``."""
    lines = [
        f"# Study {run.study}, run {run.run}: what the solver {solver} is given",
        *_lines(run.scenario.model_dump(mode="json"), run.sources),
    ]
    write_text(folder / "deck.in", "\n".join(lines) + "\n")


def _lines(tree: Any, sources: Mapping[str, str], key: str = "") -> list[str]:
    """One line a value; a list with one source stays together."""
    if key in sources or not isinstance(tree, dict | list):
        return [f"{key} = {tree}".ljust(60) + f" # {sources.get(key, 'not stated')}"]
    each = tree.items() if isinstance(tree, dict) else enumerate(tree)
    return [line for n, v in each for line in _lines(v, sources, f"{key}.{n}" if key else str(n))]
