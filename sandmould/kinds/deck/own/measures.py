"""Measures of a user's deck at each row of its log, from the log or a dump, over windows."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from itertools import islice
from pathlib import Path

import numpy as np
import pandas as pd
from numpy.typing import NDArray

from sandmould.kinds.deck.own.thermo import STEP
from sandmould.scenario.own_deck import CLOCK, OwnDeck, Taken

_OF_GRAINS: dict[str, Callable[[NDArray[np.float64]], np.floating]] = {
    "mean": np.mean,
    "largest": np.max,
    "smallest": np.min,
    "sum": np.sum,
}


def measured(scenario: OwnDeck, table: pd.DataFrame, output: Path) -> pd.DataFrame:
    """Measures by name, one row a row of the log; those that cannot be read are left out.

    Parameters
    ----------
    scenario : OwnDeck
    table : DataFrame
        The log.
    output : Path
        Folder that the deck writes its dumps into.
    """
    found = {}
    time_s = table[CLOCK].to_numpy() if CLOCK in table else np.full(len(table), np.nan)
    for name, taken in scenario.taken.items():
        if not taken.dump and taken.of in table:
            found[name] = over_window(time_s, table[taken.of].to_numpy(), taken)
        elif taken.dump and len(table) and not _unread(taken, output):
            steps = table[STEP].to_numpy()
            of_grains = _OF_GRAINS[taken.grains]
            each = {step: float(of_grains(x)) for step, x in _frames(output, taken)}
            step = np.array(sorted(each))
            values = over_window(
                np.interp(step, steps, time_s), np.array([each[s] for s in step]), taken
            )
            newest = np.searchsorted(step, steps, side="right") - 1
            found[name] = np.where(newest < 0, np.nan, values[newest])
    return pd.DataFrame(found, index=table.index)


def over_window(
    time_s: NDArray[np.float64], value: NDArray[np.float64], taken: Taken
) -> NDArray[np.float64]:
    """What is taken of values up to each moment: the mean of the line through them, or its rate.

    Parameters
    ----------
    time_s, value : (n,) float64
    taken : Taken

    Returns
    -------
    (n,) float64
        NaN where the window holds no moment, and no two of a rate.
    """
    if taken.take == "last":
        return value
    begins_s = np.full(len(time_s), taken.from_s or 0.0)
    if taken.over_last_s is not None:
        begins_s = time_s - taken.over_last_s
    # round-off of the engine's clock
    first = np.searchsorted(time_s, begins_s - 1e-9 * np.abs(time_s))
    now = np.arange(len(time_s))
    inside = first <= now
    first = np.minimum(first, now)
    length_s = time_s - time_s[first]
    areas = (value[1:] + value[:-1]) / 2 * np.diff(time_s)
    area = np.concatenate([[0.0], np.cumsum(areas)])
    change = area - area[first] if taken.take == "mean" else value - value[first]
    at_once = value if taken.take == "mean" else np.full(len(value), np.nan)
    with np.errstate(divide="ignore", invalid="ignore"):
        return np.where(inside, np.where(length_s > 0, change / length_s, at_once), np.nan)


def missing_dump(scenario: OwnDeck, output: Path) -> str:
    """Say which measure cannot be read from its dump; nothing where each can."""
    dumped = [(name, taken) for name, taken in scenario.taken.items() if taken.dump]
    said = [f"{why} (measures.{name})" for name, taken in dumped if (why := _unread(taken, output))]
    return said[0] if said else ""


def _unread(taken: Taken, output: Path) -> str:
    if not (output / taken.dump).is_file():
        return f"the deck wrote no file {taken.dump}"
    return "" if any(_frames(output, taken)) else f"{taken.dump} has no moment with {taken.of}"


def _frames(output: Path, taken: Taken) -> Iterator[tuple[int, NDArray[np.float64]]]:
    """Steps of a dump of text, each with a column of its grains; a last one cut short is no more.

    A run that went on writes some steps twice.
    """
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
                    yield step, np.array([float(row[place]) for row in rows])
