"""Charts of the pressure at the probes of a flow, at every step."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import pandas as pd
from numpy.typing import NDArray

from sandmould.drawing.chart import Chart, Line, tints
from sandmould.runs.columns import TIME_S

BINS = 300
"""Of a history; of the steps in each its lowest and its highest value are drawn."""
HIGHEST = 3.0
"""Peaks above so many times the largest hydrostatic pressure are cut off."""


@dataclass(frozen=True)
class PressureHistory:
    """The pressure of one run in time."""

    chart: Chart
    setting: str
    rating: str


def pressure_history(
    folder: Path, setting: str, rating: str, ideal_pa: Mapping[str, float]
) -> PressureHistory:
    """Draw the pressure at each probe of a run, with its hydrostatic value.

    Parameters
    ----------
    folder : Path
        Of the run.
    setting, rating : str
        What is swept, and how stable the run is.
    ideal_pa : mapping of probe to float, Pa
    """
    table = pd.read_csv(folder / "series.tsv", sep="\t")
    time_s = table[TIME_S].to_numpy(dtype=np.float64)
    top_pa = HIGHEST * max(ideal_pa.values())
    lines = []
    for (name, ideal), tint in zip(ideal_pa.items(), tints(len(ideal_pa), False), strict=True):
        pressure_pa = np.minimum(table[f"{name}_pa"].to_numpy(dtype=np.float64), top_pa)
        level = np.array([[time_s[0], ideal], [time_s[-1], ideal]])
        lines += [
            Line(extremes(time_s, pressure_pa), tint, "run", name, f"pressure at {name}"),
            Line(level, tint, "joined", title=f"hydrostatic at {name}: {ideal:.0f} Pa"),
        ]
    alt = f"Pressure at {', '.join(ideal_pa)} against time at {setting}: {rating}."
    return PressureHistory(Chart("time, s", "pressure, Pa", alt, tuple(lines)), setting, rating)


def extremes(x: NDArray[np.float64], y: NDArray[np.float64]) -> NDArray[np.float64]:
    """The lowest and the highest point of each part of a curve, in their order.

    Parameters
    ----------
    x, y : (n,) float64

    Returns
    -------
    (k, 2) float64
        All points where there are at most two a part; NaN is passed over.
    """
    points = np.column_stack([x, y])[np.isfinite(y)]
    if len(points) <= 2 * BINS:
        return points
    chosen = {
        place
        for part in np.array_split(np.arange(len(points)), BINS)
        for place in (part[points[part, 1].argmin()], part[points[part, 1].argmax()])
    }
    drawn: NDArray[np.float64] = points[sorted(chosen)]
    return drawn
