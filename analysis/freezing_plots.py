"""Pictures of a casting: when each part of it froze, and how warm casting and mould are."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np
from matplotlib.axes import Axes
from numpy.typing import NDArray

from sandmould.analysis.freezing import Freezing

Array = NDArray[np.float64]
MOST_SPOTS = 12


def draw_freezing(fields: Mapping[str, Array], freezing: Freezing, axes: Axes) -> None:
    """Draw freezing times over the casting with hot spots and the last point to freeze.

    Parameters
    ----------
    fields : mapping
        Arrays of ``fields.npz``.
    freezing : Freezing
    axes : Axes
    """
    cut, axis = _cut(fields, freezing)
    melts = cut["melts"].astype(bool)
    values = np.where(melts, cut["frozen_s"], np.nan)
    _draw(cut, axis, values, axes, "frozen at, s", "viridis")
    beside_mm = 1e3 * (cut["position_m"][melts].min(axis=0) - 3.0 * cut["size_m"].max())
    beyond_mm = 1e3 * (cut["position_m"][melts].max(axis=0) + 3.0 * cut["size_m"].max())
    axes.set_xlim(beside_mm[0], beyond_mm[0])
    axes.set_ylim(beside_mm[1], beyond_mm[1])
    spots_mm = 1e3 * _flat(freezing.hot_spots_m[:MOST_SPOTS], axis)
    axes.plot(*spots_mm.T, "o", mfc="none", mec="#D55E00", ms=9, mew=1.5, label="hot spot")
    if np.isfinite(freezing.last_point_m).all():
        at = f"last to freeze, {freezing.solidification_time_s:.0f} s"
        axes.plot(
            *(1e3 * _flat(freezing.last_point_m[None], axis).T),
            "x",
            color="#D55E00",
            ms=9,
            mew=2,
            label=at,
        )
    axes.legend(fontsize=8, loc="upper right")


def draw_temperature(fields: Mapping[str, Array], freezing: Freezing, axes: Axes) -> None:
    """Draw temperatures at the end over casting and mould, as ``draw_freezing``."""
    cut, axis = _cut(fields, freezing)
    _draw(cut, axis, cut["temperature_k"], axes, "temperature at the end, K", "inferno")


def _cut(fields: Mapping[str, Array], freezing: Freezing) -> tuple[dict[str, Array], int]:
    """Elements of 3D that a plane through the last point to freeze cuts; all of 2D.

    Of the three planes the one with most of the casting; given with its normal's number.
    """
    position_m, half_m = fields["position_m"], 0.5 * fields["size_m"]
    if position_m.shape[1] == 2:
        return dict(fields), 2
    through_m = freezing.last_point_m
    if not np.isfinite(through_m).all():
        through_m = freezing.hot_spots_m[0]
    melts = fields["melts"].astype(bool)
    # a plane between elements belongs to those above it
    off = position_m - through_m
    within = (off > -half_m[:, None] - 1e-9) & (off <= half_m[:, None] - 1e-9)
    area = ((2.0 * half_m[melts, None]) ** 2 * within[melts]).sum(axis=0)
    axis = int(np.argmax(area))
    cut = {name: values[within[:, axis]] for name, values in fields.items()}
    return cut | {"position_m": _flat(cut["position_m"], axis)}, axis


def _flat(place_m: Array, axis: int) -> Array:
    """Places without one of three coordinates."""
    return np.delete(place_m, axis, axis=1) if place_m.shape[1] == 3 else place_m


def _draw(
    fields: Mapping[str, Array], axis: int, values: Array, axes: Axes, title: str, colours: str
) -> None:
    grid, low_m, high_m = _grid(fields["position_m"], fields["size_m"], values)
    (left, below), (right, above) = (1e3 * low_m).tolist(), (1e3 * high_m).tolist()
    image = axes.imshow(
        grid.T, origin="lower", extent=(left, right, below, above), cmap=colours,
        interpolation="nearest",
    )  # fmt: skip
    figure = axes.figure
    figure.colorbar(image, ax=axes, label=title, shrink=0.85)
    across, up = (name for place, name in enumerate("xyz") if place != axis)
    axes.set_xlabel(f"{across}, mm")
    axes.set_ylabel(f"{up}, mm")


def _grid(position_m: Array, size_m: Array, values: Array) -> tuple[Array, Array, Array]:
    """Values on cells of the smallest size, larger elements over several of them."""
    cell_m = float(size_m.min())
    low_m = (position_m - 0.5 * size_m[:, None]).min(axis=0)
    high_m = (position_m + 0.5 * size_m[:, None]).max(axis=0)
    grid = np.full(np.round((high_m - low_m) / cell_m).astype(int), np.nan)
    corner = np.round((position_m - 0.5 * size_m[:, None] - low_m) / cell_m).astype(int)
    span = np.round(size_m / cell_m).astype(int)
    for cells in np.unique(span):
        own = span == cells
        for i in range(cells):
            for j in range(cells):
                grid[corner[own, 0] + i, corner[own, 1] + j] = values[own]
    return grid, low_m, high_m
