"""How a deck of the user's own is run and measured."""

from __future__ import annotations

import math
from pathlib import Path

import pandas as pd

from sandmould.definition.run import LAST_MEASURED, Run
from sandmould.kinds.deck.own import computation
from sandmould.kinds.deck.own import deck as own_deck
from sandmould.kinds.kind import Execution
from sandmould.runs.files import replaced, write_text
from sandmould.runs.products import Computed, Cost
from sandmould.scenario.own_deck import OwnDeck


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
    clock = {"time_s": time_s, "vibration_time_s": math.nan, "stage": "deck"}
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


EXECUTION = Execution[OwnDeck](
    products=("series.tsv", computation.OUTPUT),
    render=render,
    compute=compute,
    complete=computation.write_series,
    no_cost=no_cost,
    measure=measure,
)
