"""Measures of a user's deck at each row of its log, from the log or a dump, over windows."""

from __future__ import annotations

import math
from collections.abc import Iterator
from itertools import islice
from pathlib import Path

import numpy as np
import pandas as pd
from numpy.typing import NDArray

from sandmould.definition.run import LAST_MEASURED, PICTURE
from sandmould.kinds.deck.own.deck import OUTPUT
from sandmould.kinds.deck.own.thermo import LOGGED, STEP
from sandmould.runs.files import replaced
from sandmould.scenario.own_deck import OwnDeck, Taken


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


def measured(scenario: OwnDeck, series: pd.DataFrame, output: Path) -> pd.DataFrame:
    """Measures by name, one row a row of the log; those that cannot be read are left out.

    ``series``: time in s and the columns of the log, see ``computation.series``; ``output``: folder
    that the deck wrote its dumps into.
    """
    found = {}
    time_s = series["time_s"].to_numpy() if "time_s" in series else np.full(len(series), np.nan)
    for name, taken in scenario.taken.items():
        if not taken.dump and LOGGED + taken.of in series:
            found[name] = over_window(time_s, series[LOGGED + taken.of].to_numpy(), taken)
        elif taken.dump and len(series) and (each := dict(_moments(output, taken))):
            steps, step = series[LOGGED + STEP].to_numpy(), np.array(sorted(each))
            values = np.array([each[one] for one in step])
            values = over_window(np.interp(step, steps, time_s), values, taken)
            newest = np.searchsorted(step, steps, side="right") - 1
            found[name] = np.where(newest < 0, np.nan, values[newest])
    return pd.DataFrame(found, index=series.index)


def over_window(
    time_s: NDArray[np.float64], value: NDArray[np.float64], taken: Taken
) -> NDArray[np.float64]:
    """What is taken of values up to each moment, (n,) float64 as these; NaN before the window.

    The mean of the line through them, or its rate: over the stretch before a moment at least.
    """
    if taken.take == "last":
        return value
    begins_s = np.full(len(time_s), taken.from_s or 0.0)
    if taken.over_last_s is not None:
        begins_s = time_s - taken.over_last_s
    first = np.searchsorted(time_s, begins_s - 1e-9 * np.abs(time_s))  # round-off of the clock
    now, total = np.arange(len(time_s)), value
    if taken.take == "mean":
        areas = (value[1:] + value[:-1]) / 2 * np.diff(time_s)
        total = np.concatenate([[0.0], np.cumsum(areas)])
    begin = np.minimum(first, np.maximum(now - 1, 0))
    with np.errstate(divide="ignore", invalid="ignore"):
        per_s = (total - total[begin]) / (time_s - time_s[begin])
    return np.where(first > now, np.nan, per_s)


def missing_dump(scenario: OwnDeck, output: Path) -> str:
    """Say which measures cannot be read from a dump; nothing where all can."""
    lacks = [
        f"{taken.dump} with {taken.of} (measures.{name})"
        for name, taken in scenario.taken.items()
        if taken.dump and not any(_moments(output, taken))
    ]
    return f"the deck wrote no {', '.join(lacks)}" if lacks else ""


def _moments(output: Path, taken: Taken) -> Iterator[tuple[int, float]]:
    """Steps of a dump of text and what of the grains counts; a last one cut short is left out.

    A run that went on writes some steps twice.
    """
    if not (output / taken.dump).is_file():
        return
    step = grains = 0
    with (output / taken.dump).open(encoding="utf-8", errors="replace") as dump:
        for line in dump:
            if line.startswith("ITEM: TIMESTEP"):
                step = int(next(dump, "0"))
            elif line.startswith("ITEM: NUMBER OF ATOMS"):
                grains = int(next(dump, "0"))
            elif line.startswith("ITEM: ATOMS") and taken.of in (columns := line.split()[2:]):
                place = columns.index(taken.of)
                rows = [row.split() for row in islice(dump, grains)]
                if grains and len(rows) == grains and len(rows[-1]) == len(columns):
                    column = [float(row[place]) for row in rows]
                    yield step, float(getattr(np, taken.grains)(column))
