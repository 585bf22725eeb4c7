"""Studies of a deck of the user's own."""

from __future__ import annotations

import math
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import pandas as pd

from sandmould.digest import SHORT, digest
from sandmould.engines.own_deck import computation
from sandmould.engines.own_deck import deck as own_deck
from sandmould.engines.registry import engine_module
from sandmould.runs.files import replaced, write_text
from sandmould.runs.products import Computed, Cost
from sandmould.scenario.bad_input import Problem
from sandmould.scenario.own_deck import OwnDeck
from sandmould.study.kinds.kind import SpeedClass
from sandmould.study.moments import LAST_MEASURED
from sandmould.study.run import Run

MODEL = OwnDeck
WORK = "core-seconds"
PRODUCTS = ("series.tsv", computation.OUTPUT)
_ALLOWED = 3.0
"""Wall time to ask for over what the user expects."""

resolved = own_deck.with_hashes
problems = own_deck.problems
complete = computation.write_series


def defaults() -> dict[str, Any]:
    """Nothing: template and measures are the user's."""
    return {}


def lasts_s(scenario: OwnDeck) -> float:
    """Measures are those of the last row of the log."""
    return 0.0


def engine_problem(scenario: OwnDeck) -> Problem | None:
    """Say how the engine is installed where it is missing."""
    valid = engine_module(scenario.engine.name).installation_problem()
    return None if valid is None else Problem("engine.name", scenario.engine.name, valid)


def sources(scenario: OwnDeck) -> list[Path]:
    """Template and files."""
    return list(scenario.paths.values())


def template_hash(scenario: OwnDeck) -> str:
    """Hash of template and files as they are now."""
    now = own_deck.with_hashes(scenario.model_copy(update={"sha256": {}})).sha256
    return digest(*sorted(now.values()))[:SHORT]


def computed_hash(scenario: OwnDeck) -> str:
    """Hash of the rendered deck and of the files that it reads."""
    return digest(own_deck.render(scenario, "run", "study"), template_hash(scenario))


def threads(scenario: OwnDeck) -> int:
    """One a rank."""
    return scenario.engine.ranks


def ranks(scenario: OwnDeck) -> int:
    """MPI ranks."""
    return scenario.engine.ranks


def memory_mb(scenario: OwnDeck) -> int:
    """As the user states it."""
    return scenario.memory_mb


def allowed_s(scenario: OwnDeck) -> float:
    """Several times what the user expects."""
    return _ALLOWED * predicted_s(scenario)


def planned_work(scenario: OwnDeck) -> float:
    """Processor time that the user expects."""
    return scenario.expected_core_s


def predicted_s(scenario: OwnDeck) -> float:
    """Expected processor time, shared by the ranks."""
    return scenario.expected_core_s / scenario.engine.ranks


def planned_s(scenario: OwnDeck) -> float:
    """Only the deck knows: 0 stands for that."""
    return 0.0


def speed_class(scenario: OwnDeck) -> SpeedClass:
    """By engine."""
    return scenario.engine.name, 0


def rate(scenario: OwnDeck, results: Path) -> float:
    """Work is time here."""
    return 1.0


def plan_cells(scenario: OwnDeck) -> Mapping[str, str]:
    """Its template, and its steps where the user states them."""
    steps = f"{scenario.steps:,}" if scenario.steps else "unknown"
    return {"template": Path(scenario.template).name, "steps": steps}


def render(run: Run, folder: Path) -> None:
    """Write the deck as the engine reads it at the beginning."""
    own_deck.check_unchanged(run.scenario)
    text = own_deck.render(run.scenario, run.run, run.study)
    write_text(folder / "deck.in", text)


def compute(run: Run, folder: Path) -> Computed:
    """Have the engine read the deck."""
    return computation.compute(run.scenario, folder, run.run, run.study)


def no_cost(scenario: OwnDeck) -> Cost:
    """Cost before the engine has started."""
    return Cost(scenario.engine.name, scenario.engine.ranks, math.nan, math.nan)


def measure(run: Run, folder: Path) -> None:
    """Write the measures against time, and draw them."""
    series = pd.read_csv(folder / "series.tsv", sep="\t")
    names = [name for name in run.scenario.measures if name in series]
    time_s = series["time_s"] if "time_s" in series else pd.Series(dtype=float)
    clock = {"time_s": time_s, "vibration_time_s": -1.0, "stage": "deck"}
    table = pd.DataFrame({**clock, **{name: series[name] for name in names}})
    with replaced(folder / "measures.tsv") as partial:
        table.to_csv(partial, sep="\t", index=False)
    _draw(table, names, folder / LAST_MEASURED)


def _draw(table: pd.DataFrame, names: list[str], out: Path) -> None:
    """One panel a measure, over time."""
    from matplotlib.figure import Figure

    rows = max(len(names), 1)
    figure = Figure(figsize=(6, 1 + 1.8 * rows), dpi=150, layout="constrained")
    panels = figure.subplots(rows, 1, sharex=True, squeeze=False)[:, 0]
    for panel, name in zip(panels, names, strict=False):
        panel.plot(table["time_s"], table[name], lw=1)
        panel.set_ylabel(name)
    panels[-1].set_xlabel("time, s")
    figure.savefig(out)
