"""How what a deck of the user's own left is measured: columns of its log, over time."""

from __future__ import annotations

import math
from pathlib import Path

import pandas as pd

from sandmould.definition.run import LAST_MEASURED, PICTURE
from sandmould.runs.files import replaced
from sandmould.scenario.own_deck import OwnDeck


def measure_deck(scenario: OwnDeck, folder: Path) -> None:
    """Write the measures against time."""
    series = pd.read_csv(folder / "series.tsv", sep="\t")
    names = [name for name in scenario.measures if name in series]
    time_s = series["time_s"] if "time_s" in series else pd.Series(dtype=float)
    clock = {"time_s": time_s, "vibration_time_s": math.nan, "stage": "deck"}
    table = pd.DataFrame({**clock, **{name: series[name] for name in names}})
    with replaced(folder / LAST_MEASURED) as partial:
        table.to_csv(partial, sep="\t", index=False)


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
