"""How what a deck of the user's own left is measured: columns of its log, over time."""

from __future__ import annotations

import math
from pathlib import Path

import pandas as pd

from sandmould.definition.run import LAST_MEASURED, PICTURE
from sandmould.kinds.deck.own.deck import OUTPUT
from sandmould.kinds.deck.own.measures import measured
from sandmould.runs.files import replaced
from sandmould.scenario.own_deck import OwnDeck


def measure_deck(scenario: OwnDeck, folder: Path) -> None:
    """Write the measures against time."""
    series, each = _measured(scenario, folder)
    time_s = series["time_s"] if "time_s" in series else pd.Series(dtype=float)
    clock = {"time_s": time_s, "vibration_time_s": math.nan, "stage": "deck"}
    table = pd.DataFrame({**clock, **each})
    with replaced(folder / LAST_MEASURED) as partial:
        table.to_csv(partial, sep="\t", index=False)


def unmeasurable(scenario: OwnDeck, folder: Path) -> list[str]:
    """Names of the measures that cannot be read from what a run left."""
    _, each = _measured(scenario, folder)
    return [name for name in scenario.measures if name not in each]


def _measured(scenario: OwnDeck, folder: Path) -> tuple[pd.DataFrame, pd.DataFrame]:
    """Log of a run and its measures, one row a row of the log."""
    series = pd.read_csv(folder / "series.tsv", sep="\t")
    return series, measured(scenario, series, folder / OUTPUT)


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
