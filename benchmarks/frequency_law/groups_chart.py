"""The picture of what collapses the curves of the law."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

import numpy as np
import pandas as pd
from matplotlib import colormaps
from matplotlib.colors import LogNorm
from matplotlib.figure import Figure

from benchmarks.frequency_law.groups import FillLaw, predicted_by_others, shaken_range


def draw(settings: pd.DataFrame, velocities_m_s: Sequence[float], path: Path) -> None:
    """Fill over f/(c/4H) at some velocities, and fill as predicted by other curves over fill.

    Parameters
    ----------
    settings : DataFrame
        As of ``settings_of``.
    velocities_m_s : sequence of float
        Whose lines are drawn, where the tube was shaken so.
    path : Path
        Of the PNG.
    """
    figure = Figure(figsize=(10.0, 4.2), layout="constrained")
    left, right = figure.subplots(1, 2)
    law, colours = FillLaw(settings), colormaps["viridis"]
    velocities = settings["velocity_m_s"]
    norm = LogNorm(velocities.min(), velocities.max())
    dots = left.scatter(
        settings["in_modes"], settings["fill"], c=velocities, cmap=colours, norm=norm, s=16
    )
    for velocity in velocities_m_s:
        at = np.geomspace(*shaken_range(settings, velocity), 100)
        predicted = law.at(pd.DataFrame({"velocity_m_s": velocity, "in_modes": at}))
        left.plot(at, predicted, color=colours(norm(velocity)), lw=1.5)
        left.annotate(f"{1e3 * velocity:g} mm/s", (at[-1], predicted[-1]), fontsize=8)
    left.set(
        xscale="log", xlabel="frequency over c/(4 H)", ylabel="fill of the tube",
        title="all settings, and the law at three velocities",
    )  # fmt: skip
    figure.colorbar(dots, ax=left, label="peak velocity of the box, m/s")
    predicted = predicted_by_others(settings)
    for (study, label), mine in settings.groupby(["study", "label"], sort=False):
        name = f"{str(study).removeprefix('tube_law_')}, {label}"
        right.errorbar(
            predicted[mine.index], mine["fill"], yerr=mine["se"], fmt="o", ms=4, lw=1, label=name
        )
    ends = [settings["fill"].min(), settings["fill"].max()]
    right.plot(ends, ends, color="0.5", lw=1)
    right.set(
        xlabel="fill as predicted from the other curves",
        ylabel="fill of the tube",
        title="curve by curve",
    )
    right.legend(fontsize=7)
    for ax in (left, right):
        ax.grid(alpha=0.3)
        ax.title.set_fontsize(9)
    figure.savefig(path, dpi=110, metadata={"Software": None})
