"""The picture of the law of the best frequency."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.ticker import LogLocator, NullFormatter

from benchmarks.frequency_law.series import Series

_COLOURS = ("#0072B2", "#D55E00", "#009E73", "#CC79A7")


def draw(studies: Sequence[dict[str, Any]], path: Path) -> None:
    """Draw each study's curves twice: over frequency, and over frequency in units of c/(4 H).

    Parameters
    ----------
    studies : sequence of dict
        ``title`` and ``series`` of each.
    path : Path
        Of the PNG.
    """
    figure = Figure(figsize=(10.0, 3.6 * len(studies)), layout="constrained")
    for study, row in zip(studies, figure.subplots(len(studies), 2, squeeze=False), strict=True):
        for ax, in_modes in zip(row, (False, True), strict=True):
            for series, colour in zip(study["series"], _COLOURS, strict=False):
                _curve(ax, series, colour, in_modes)
            ax.set_xscale("log")
            ax.xaxis.set_major_locator(LogLocator(subs=(1.0, 2.0, 5.0)))
            ax.xaxis.set_major_formatter("{x:g}")
            ax.xaxis.set_minor_formatter(NullFormatter())
            ax.set_xlabel("frequency over c/(4 H)" if in_modes else "frequency, Hz")
            ax.set_ylabel("fill of the tube")
            ax.grid(alpha=0.3)
        row[0].set_title(study["title"], fontsize=9, loc="left")
        if len(study["series"]) > 1:
            row[0].legend(fontsize=8)
    figure.savefig(path, dpi=110, metadata={"Software": None})


def _curve(ax: Axes, series: Series, colour: str, in_modes: bool) -> None:
    hz = series.fills.columns.to_numpy(dtype=np.float64)
    x = hz / series.column_hz if in_modes else hz
    error = series.fills.std().to_numpy() / np.sqrt(series.fills.count().to_numpy())
    ax.errorbar(
        x, series.fills.mean(), yerr=error, fmt="o-", ms=3, lw=1.2, capsize=2, color=colour,
        label=series.label,
    )  # fmt: skip
