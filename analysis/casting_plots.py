"""Pictures of castings: when each part froze, how warm casting and mould are, how metal flows."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from matplotlib.axes import Axes
from matplotlib.collections import EllipseCollection
from numpy.typing import NDArray

from sandmould.analysis.feeding import NIYAMA_LOW, owner_grid
from sandmould.analysis.freezing import Freezing
from sandmould.scenario.units import ZERO_K

Array = NDArray[np.float64]
DistanceM = Callable[[Array], Array]
"""Signed distance of places (n, d) from the surface of what is cast, (n,) float64, m."""
MOST_SPOTS = 12
_INK, _CAST, _SAND = "#222222", "#B9BEC4", "#F1E5CC"
_PLACES = 240
"""Along each side of a picture, at which that distance is asked for to draw an outline."""
WALL_COLOUR = "#bbbbbb"


def draw_freezing(
    fields: Mapping[str, Array],
    freezing: Freezing,
    axes: Axes,
    outlined: Sequence[DistanceM] = (),
) -> None:
    """Draw freezing times over the casting with hot spots and the last point to freeze.

    ``outlined``: distances from what is cast, whose outline is then drawn, and from its risers,
    which are dashed.
    """
    cut, axis, at_m = _cut(fields, freezing)
    melts = cut["melts"].astype(bool)
    values = np.where(melts, cut["frozen_s"], np.nan)
    _draw(cut, axis, values, axes, "frozen at, s", "viridis")
    _draw_outlines(cut, axis, at_m, axes, outlined)
    _frame_casting(cut, axes)
    spots_mm = 1e3 * _flat(freezing.hot_spots_m[:MOST_SPOTS], axis)
    axes.plot(*spots_mm.T, "o", mfc="none", mec=_INK, ms=9, mew=1.5, label="hot spot")
    if np.isfinite(freezing.last_point_m).all():
        at = f"last to freeze, {freezing.solidification_time_s:.0f} s"
        axes.plot(
            *(1e3 * _flat(freezing.last_point_m[None], axis).T),
            "x",
            color=_INK,
            ms=9,
            mew=2,
            label=at,
        )
    axes.legend(fontsize=8, loc="lower center", bbox_to_anchor=(0.5, 1.0), ncols=2, frameon=False)


def draw_temperature(
    fields: Mapping[str, Array],
    freezing: Freezing,
    axes: Axes,
    outlined: Sequence[DistanceM] = (),
) -> None:
    """Draw temperatures at the end over casting and mould, as ``draw_freezing``."""
    cut, axis, at_m = _cut(fields, freezing)
    celsius = cut["temperature_k"] - ZERO_K
    _draw(cut, axis, celsius, axes, "temperature at the end, °C", "inferno")
    _draw_outlines(cut, axis, at_m, axes, outlined)


def draw_niyama(
    fields: Mapping[str, Array],
    freezing: Freezing,
    axes: Axes,
    outlined: Sequence[DistanceM] = (),
) -> None:
    """Draw Niyama's value over the casting, as ``draw_freezing``; twice its limit is the most."""
    cut, axis, at_m = _cut(fields, freezing)
    niyama = 1e-3 * cut["niyama_sqrt_ks_m"]
    most = 2e-3 * NIYAMA_LOW
    _draw(cut, axis, niyama, axes, "Niyama, (K s)$^{1/2}$/mm", "RdYlBu", (0.0, most))
    _draw_outlines(cut, axis, at_m, axes, outlined)
    _frame_casting(cut, axes)


def draw_modulus(
    fields: Mapping[str, Array],
    freezing: Freezing,
    axes: Axes,
    outlined: Sequence[DistanceM] = (),
) -> None:
    """Draw the modulus over the casting, as ``draw_freezing``."""
    cut, axis, at_m = _cut(fields, freezing)
    _draw(cut, axis, 1e3 * cut["modulus_m"], axes, "modulus by freezing time, mm", "cividis")
    _draw_outlines(cut, axis, at_m, axes, outlined)
    _frame_casting(cut, axes)


def _frame_casting(cut: Mapping[str, Array], axes: Axes) -> None:
    """Show the casting alone, with a rim."""
    casting_m, rim_m = cut["position_m"][cut["melts"].astype(bool)], 3.0 * cut["size_m"].max()
    low_mm, high_mm = 1e3 * (casting_m.min(axis=0) - rim_m), 1e3 * (casting_m.max(axis=0) + rim_m)
    axes.set_xlim(low_mm[0], high_mm[0])
    axes.set_ylim(low_mm[1], high_mm[1])


def _draw_outlines(
    cut: Mapping[str, Array], axis: int, at_m: float, axes: Axes, outlined: Sequence[DistanceM]
) -> None:
    """The part as it is drawn, and its risers, over the elements that stand for it."""
    ends_m = cut["position_m"].min(axis=0), cut["position_m"].max(axis=0)
    for distance_m, style in zip(outlined, ("solid", "dashed"), strict=False):
        along_mm, outside_m = _section(*ends_m, axis, at_m, distance_m)
        if outside_m.min() < 0.0:  # the cut may miss the risers
            axes.contour(*along_mm, outside_m, [0.0], colors=_INK, linewidths=1, linestyles=style)


def draw_part(low_m: Array, high_m: Array, at_m: float, axes: Axes, distance_m: DistanceM) -> None:
    """Draw what is cast in its box before anything runs, in 3D where a plane cuts it.

    ``low_m``, ``high_m``, (d,) float64, m: corners of the box. ``at_m``: in 3D, y of the plane of x
    and z.
    """
    axis = 1 if len(low_m) == 3 else 2
    kept = [each for each in range(len(low_m)) if each != axis]
    at_m = at_m if axis == 1 else np.nan
    along_mm, outside_m = _section(low_m[kept], high_m[kept], axis, at_m, distance_m)
    axes.contourf(*along_mm, outside_m, [-np.inf, 0.0], colors=[_CAST])
    axes.contour(*along_mm, outside_m, [0.0], colors=_INK, linewidths=1)
    axes.set_facecolor(_SAND)
    axes.set_aspect("equal")
    _name_axes(axes, axis)


def _section(
    low_m: Array, high_m: Array, axis: int, at_m: float, distance_m: DistanceM
) -> tuple[list[Array], Array]:
    """Places along both axes of a plane, mm, and the distance from what is cast, m."""
    along = [np.linspace(*ends, _PLACES) for ends in zip(low_m, high_m, strict=True)]
    places_m = np.stack(np.meshgrid(*along), axis=-1).reshape(-1, 2)
    if np.isfinite(at_m):
        places_m = np.insert(places_m, axis, at_m, axis=1)
    return [1e3 * each for each in along], distance_m(places_m).reshape(_PLACES, _PLACES)


def _cut(fields: Mapping[str, Array], freezing: Freezing) -> tuple[dict[str, Array], int, float]:
    """Elements of 3D that a plane through the last point to freeze cuts; all of 2D."""
    # Of the three planes that with most of the casting; its normal's number, its place in m.
    position_m, half_m = fields["position_m"], 0.5 * fields["size_m"]
    if position_m.shape[1] == 2:
        return dict(fields), 2, np.nan
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
    at_m = float(through_m[axis])
    return cut | {"position_m": _flat(cut["position_m"], axis)}, axis, at_m


def _flat(place_m: Array, axis: int) -> Array:
    return np.delete(place_m, axis, axis=1) if place_m.shape[1] == 3 else place_m


def _draw(
    fields: Mapping[str, Array],
    axis: int,
    values: Array,
    axes: Axes,
    title: str,
    colours: str,
    limits: tuple[float, float] | None = None,
) -> None:
    grid, low_m, high_m = _grid(fields["position_m"], fields["size_m"], values)
    (left, below), (right, above) = (1e3 * low_m).tolist(), (1e3 * high_m).tolist()
    image = axes.imshow(
        grid.T, origin="lower", extent=(left, right, below, above), cmap=colours,
        interpolation="nearest", clim=limits,
    )  # fmt: skip
    figure = axes.figure
    figure.colorbar(image, ax=axes, label=title, shrink=0.85)
    _name_axes(axes, axis)


def _name_axes(axes: Axes, axis: int) -> None:
    across, up = (name for place, name in enumerate("xyz") if place != axis)
    axes.set_xlabel(f"{across}, mm")
    axes.set_ylabel(f"{up}, mm")


def _grid(position_m: Array, size_m: Array, values: Array) -> tuple[Array, Array, Array]:
    """Values on cells of the smallest size, larger elements over several of them."""
    owner, low_m = owner_grid(position_m, size_m)
    grid = np.where(owner >= 0, values[owner], np.nan)
    return grid, low_m, low_m + float(size_m.min()) * np.array(owner.shape)


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
