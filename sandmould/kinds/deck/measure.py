"""How what a deck of the user's own left is measured: columns of its log, over time."""

from __future__ import annotations

import math
from pathlib import Path

import pandas as pd

from sandmould.bad_input import Problem
from sandmould.definition.run import LAST_MEASURED, PICTURE
from sandmould.kinds.deck.own.deck import OUTPUT
from sandmould.kinds.deck.own.measures import measured, missing_dumps
from sandmould.kinds.deck.own.thermo import LOGGED
from sandmould.runs.files import replaced
from sandmould.scenario.own_deck import OwnDeck


def measure_deck(scenario: OwnDeck, folder: Path) -> None:
    """Write the measures against time."""
    series = pd.read_csv(folder / "series.tsv", sep="\t")
    time_s = series["time_s"] if "time_s" in series else pd.Series(dtype=float)
    clock = {"time_s": time_s, "vibration_time_s": math.nan, "stage": "deck"}
    table = pd.DataFrame({**clock, **measured(scenario, series, folder / OUTPUT)})
    with replaced(folder / LAST_MEASURED) as partial:
        table.to_csv(partial, sep="\t", index=False)


def unmeasurable(scenario: OwnDeck, folder: Path) -> list[Problem]:
    """Measures that cannot be read from what a run left."""
    columns = map(str, pd.read_csv(folder / "series.tsv", sep="\t", nrows=0))
    has = [name.removeprefix(LOGGED) for name in columns if name.startswith(LOGGED)]
    valid = f"a column of the log of the runs that have ended: {', '.join(has)}"
    wrong = [
        Problem(f"measures.{name}", column, valid)
        for name, column in scenario.columns.items()
        if column not in has
    ]
    of_dump = "a column of a dump that the runs which have ended wrote"
    return wrong + [
        Problem(f"measures.{name}", f"{taken.of} of {taken.dump}", of_dump)
        for name, taken in missing_dumps(scenario, folder / OUTPUT)
    ]


def draw_measures(scenario: OwnDeck, folder: Path) -> None:
    """Draw the measures of a run over time, one panel each."""
    from matplotlib.figure import Figure

    table = pd.read_csv(folder / LAST_MEASURED, sep="\t")
    names = [name for name in scenario.measures if name in table]
    rows = max(len(names), 1)
    figure = Figure(figsize=(6, 1 + 1.8 * rows), dpi=150, layout="constrained")
    panels = figure.subplots(rows, 1, sharex=True, squeeze=False)[:, 0]
    for panel, name in zip(panels, names, strict=False):
        panel.plot(table["time_s"], table[name], lw=1)
        panel.set_ylabel(name)
    panels[-1].set_xlabel("time, s")
    figure.savefig(folder / PICTURE)
