"""What kinds of casting have in common: solvers of our own, which take a whole scenario."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any, Protocol

import numpy as np

from sandmould.bad_input import Problem
from sandmould.definition.run import LAST_MEASURED, Run
from sandmould.kinds.kind import (
    Execution,
    MachineSpeed,
    Note,
    Planning,
    ScenarioT,
    SpeedClass,
    nothing_beside,
)
from sandmould.runs.files import replaced, write_text
from sandmould.runs.measures import MeasureGroup
from sandmould.runs.products import Computed, Cost

if TYPE_CHECKING:
    import pandas as pd
    from matplotlib.axes import Axes

SLOWER = 10.0
"""Than predicted a machine may be, and a run longer than expected."""


class CastingSolver(Protocol):
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


def casting_planning(
    solver: CastingSolver,
    *,
    work_unit: str,
    resolved: Callable[[ScenarioT], ScenarioT],
    problems: Callable[[ScenarioT], list[Problem]],
    measures: tuple[MeasureGroup[ScenarioT], ...],
    threads: Callable[[ScenarioT], int],
    memory_mb: Callable[[ScenarioT], int],
    planned_work: Callable[[ScenarioT], float],
    predicted_s: Callable[[ScenarioT], float],
    planned_s: Callable[[ScenarioT], float],
    speed_class: Callable[[ScenarioT], SpeedClass],
    plan_cells: Callable[[ScenarioT], Mapping[str, str]],
    notes: Callable[[ScenarioT], Sequence[Note]],
    measuring: tuple[str, ...],
    speed: MachineSpeed[ScenarioT],
    beside_s: Callable[[ScenarioT], float] = nothing_beside,
) -> Planning[ScenarioT]:
    """Plan runs whose solver is our own: no engine can be missing, nothing runs under MPI.

    Measures are those of the end, and a slow machine is given ``SLOWER`` times the predicted time.
    Parameters are those of ``Planning``.
    """
    return Planning(
        work_unit=work_unit,
        resolved=resolved,
        problems=problems,
        engine_problem=lambda scenario: None,
        measures=measures,
        vibration_s=lambda scenario: 0.0,
        sources=lambda scenario: solver.source_files(),
        template_hash=lambda scenario: solver.source_hash(),
        computed_hash=solver.computed_hash,
        threads=threads,
        ranks=lambda scenario: 1,
        memory_mb=memory_mb,
        allowed_s=lambda scenario: SLOWER * predicted_s(scenario),
        planned_work=planned_work,
        predicted_s=predicted_s,
        planned_s=planned_s,
        speed_class=speed_class,
        plan_cells=plan_cells,
        notes=notes,
        measuring=("sandmould/kinds/casting.py", *measuring),
        speed=speed,
        beside_s=beside_s,
    )


def casting_execution(
    solver: CastingSolver, products: tuple[str, ...], measure: Callable[[Run, Path], None]
) -> Execution[Any]:
    """Compute runs with a solver of our own; its deck lists all values with their sources."""
    return Execution(
        products=products,
        render=lambda run, folder: _write_values(run, folder, solver.source_hash()),
        compute=lambda run, folder: solver.compute(run.scenario, folder, run.run),
        complete=solver.complete,
        no_cost=solver.no_cost,
        measure=measure,
    )


def read_fields(folder: Path) -> dict[str, Any] | None:
    """Arrays of ``fields.npz``; None where the run broke off before it wrote them."""
    path = folder / "fields.npz"
    if not path.exists():
        return None
    with np.load(path, allow_pickle=False) as arrays:
        return dict(arrays)


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


def _write_values(run: Run, folder: Path, solver: str) -> None:
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
