"""Pictures of metal that flows: pressure over the particles of one record."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
from matplotlib.axes import Axes
from matplotlib.collections import EllipseCollection
from numpy.typing import NDArray

Array = NDArray[np.float64]
WALL_COLOUR = "#bbbbbb"


@dataclass(frozen=True)
class Frame:
    """Metal at one record, as far as it is seen."""

    time_s: float
    place_m: Array
    """(n, 2) float64, m: across and up."""
    pressure_pa: Array
    """(n,) float64, Pa."""


def frame_of(fields: Mapping[str, Array], number: int) -> Frame:
    """One record of ``fields.npz``, of a casting in space a slice through its axis."""
    ends = np.cumsum(fields["count"])
    own = slice(int(ends[number] - fields["count"][number]), int(ends[number]))
    place, pressure = fields["position_m"][own], fields["pressure_pa"][own]
    seen = _in_slice(fields, place)
    return Frame(float(fields["time_s"][number]), place[seen][:, [0, -1]], pressure[seen])


def _in_slice(fields: Mapping[str, Array], place_m: Array) -> NDArray[np.bool_]:
    """What a picture shows: all of the plane, one layer of particles in space."""
    if place_m.shape[1] == 2:
        return np.ones(len(place_m), dtype=bool)
    size_m = float(fields["particle_m"])
    return np.asarray((place_m[:, 1] > 0.0) & (place_m[:, 1] <= size_m))


def draw_frame(
    fields: Mapping[str, Array], frame: Frame, axes: Axes, highest_pa: float
) -> EllipseCollection:
    """Draw mould and metal, particles as circles coloured by pressure; for a colour bar.

    ``fields``: arrays of ``fields.npz``. ``highest_pa``: upper end of the colours; their lower end
    is 0.
    """
    wall = fields["wall_m"]
    wall = wall[_in_slice(fields, wall)][:, [0, -1]]
    size_mm = 1e3 * float(fields["particle_m"])
    for place, colour in ((wall, WALL_COLOUR), (frame.place_m, None)):
        discs = EllipseCollection(
            size_mm, size_mm, 0.0, units="xy", offsets=1e3 * place,
            offset_transform=axes.transData, facecolor=colour,
        )  # fmt: skip
        axes.add_collection(discs)
    discs.set_array(frame.pressure_pa)
    discs.set_clim(0.0, highest_pa)
    low, high = 1e3 * wall.min(axis=0) - size_mm, 1e3 * wall.max(axis=0) + size_mm
    axes.set(xlim=(low[0], high[0]), ylim=(low[1], high[1]), aspect="equal")
    return discs


def draw_last(fields: Mapping[str, Array], axes: Axes, highest_pa: float) -> None:
    """Draw the last record with its scale; arguments as ``draw_frame``."""
    last = frame_of(fields, len(fields["count"]) - 1)
    discs = draw_frame(fields, last, axes, highest_pa)
    figure = axes.figure
    figure.colorbar(discs, ax=axes, label="pressure, Pa", shrink=0.85, extend="max")
    axes.set(xlabel="x, mm", ylabel="height, mm", title=f"{last.time_s:.3g} s")
