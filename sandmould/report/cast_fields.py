"""What the fields of a casting say and show: where it froze last, and what fed it."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
from matplotlib.figure import Figure
from matplotlib.layout_engine import ConstrainedLayoutEngine
from numpy.typing import NDArray

from sandmould.analysis.casting_plots import (
    DistanceM,
    draw_freezing,
    draw_modulus,
    draw_niyama,
    draw_temperature,
)
from sandmould.analysis.feeding import NIYAMA_LOW, CutOff, Feeding, Region, feeding, region_of
from sandmould.analysis.freezing import Freezing, freezing
from sandmould.casting.arpm.scene import solids_of
from sandmould.drawing.figures import png
from sandmould.drawing.sphere_scene import SurfaceField, solid_scene
from sandmould.report.tables import Column, Table, cells, number_cell
from sandmould.runs.formatting import number
from sandmould.runs.templates import sentences
from sandmould.scenario.casting.shapes import Body
from sandmould.scenario.casting.solidification import Solidification
from sandmould.wording.next_steps import NextStep, step

_ROOMY = ConstrainedLayoutEngine(w_pad=0.12, h_pad=0.1)
"""Labels keep away from the edge."""
MOST_BOXES = 5
ALIKE = 0.01
"""Of a time or a volume: hot spots and places that are cut off are told together."""
LAST_SHARE = 0.98
"""Of the casting's time, from which on what flows is shown as the last."""


class CastFields(NamedTuple):
    """What is shown of a run's fields, and what they say."""

    pictures: str = ""
    first: tuple[str, str, str] = ("", "", "")
    """Address, alternative text and caption of the first picture; empty without fields."""
    said: tuple[str, ...] = ("No run has left fields.",)
    tables: tuple[Table, ...] = ()
    fed: Feeding | None = None
    riser: tuple[NextStep, ...] = ()
    """What to do where liquid is not fed."""


def cast_fields(folder: Path, scenario: Solidification) -> CastFields:
    """Read and draw the fields that a run has left."""
    if not (folder / "fields.npz").is_file():
        return CastFields()
    with np.load(folder / "fields.npz", allow_pickle=False) as file:
        fields = dict(file)
    melts = fields["melts"]
    place_m = fields["position_m"][melts]
    frozen = freezing(place_m, fields["frozen_s"][melts], scenario.hot_spot_reach_m)
    fed = feeding(fields)
    solids = solids_of(scenario)
    risers = [solids[number] for number in scenario.risers]
    outlined = [distance_from(some) for some in (solids, risers) if some]
    reads = fed is not None and math.isfinite(fed.low_fraction)
    figure = Figure(figsize=(11, 9.2), dpi=110, layout=_ROOMY)
    (first_axes, end), (third, fourth) = figure.subplots(2, 2)
    draw_freezing(fields, frozen, first_axes, outlined)
    draw_temperature(fields, frozen, end, outlined)
    has_modulus = fed is not None and bool(np.isfinite(fields["modulus_m"]).any())
    for axes, draw, is_known in ((third, draw_modulus, has_modulus), (fourth, draw_niyama, reads)):
        if is_known:
            draw(fields, frozen, axes, outlined)
        else:
            axes.set_axis_off()
    alone = Figure(figsize=(5.6, 4.6), dpi=110, layout=_ROOMY)
    draw_freezing(fields, frozen, alone.subplots(), outlined)
    alt = f"When each part of the casting froze in run {folder.name}, with its outline"
    dashed = "; dashed: risers" if risers else ""
    caption = f"When each part of the casting froze, and the part as drawn (line{dashed})"
    where = ", cut through the last point to freeze" if scenario.dimensions == 3 else ""
    first = png(alone, has_scales=True), alt, f"{caption}{where}."
    part = _of_part(fields, scenario)
    above_m = _above_risers_m(fields) if risers else 0.0
    like = _like_the_largest(fed.cut_off) if fed and fed.cut_off else 0
    spot_s = (part or frozen).hot_spot_s
    others = int((spot_s[1:] >= (1.0 - ALIKE) * spot_s[0]).sum())
    said = sentences(
        "frozen.j2",
        it=frozen,
        part=part,
        others=others,
        alike=ALIKE,
        fed=fed,
        like=like,
        above_m=above_m,
        is_solid=math.isfinite(frozen.solidification_time_s),
        has_risers=len(scenario.risers),
        read_at=scenario.read_at_solid_fraction,
        low_is_all=fed is not None and fed.low is not None and _is_all(fed.low, fields),
        reads=reads,
        limit=1e-3 * NIYAMA_LOW,
        infinity=math.inf,
        flat=scenario.dimensions == 2,
    )
    tables = (_spots(frozen), *([_cut_off(fed, scenario.dimensions, bool(risers))] if fed else []))
    riser: tuple[NextStep, ...] = ()
    if not risers and has_modulus and math.isfinite(frozen.solidification_time_s):
        modulus_mm = 1e3 * float(np.nanmax(fields["modulus_m"]))  # the last to freeze has the most
        riser = (step("riser", it=frozen, modulus_mm=modulus_mm, others=others),)
    elif risers and fed and fed.cut_off:
        smaller = len(fed.cut_off) - 1 - like
        riser = (step("feed", it=fed.cut_off[0].region, like=like, others=smaller),)
    if above_m:
        riser = (*riser, step("raise", above_m=above_m))
    return CastFields(png(figure, has_scales=True), first, said, tables, fed, riser)


def _of_part(fields: Mapping[str, Any], scenario: Solidification) -> Freezing | None:
    """How the casting froze without its risers; None where it has none."""
    own = fields["melts"] & ~fields["riser"] if "riser" in fields else fields["melts"]
    if not scenario.risers or not own.any():
        return None
    return freezing(fields["position_m"][own], fields["frozen_s"][own], scenario.hot_spot_reach_m)


def _is_all(region: Region, fields: Mapping[str, Any]) -> bool:
    """Whether a region reaches nearly as far as the part does."""
    own = fields["melts"] & ~fields["riser"]
    whole = region_of(*(fields[name][own] for name in ("position_m", "size_m", "volume_m3")))
    reach, of = region.high_m - region.low_m, whole.high_m - whole.low_m
    return bool((reach >= 0.9 * of).all())


def _above_risers_m(fields: Mapping[str, Any]) -> float:
    """How much higher the part reaches than its risers, m; 0 where an element could hide it."""
    place_m, size_m, riser = fields["position_m"], fields["size_m"], fields["riser"]
    top_m = place_m[:, -1] + 0.5 * size_m
    above_m = top_m[fields["melts"] & ~riser].max() - top_m[riser].max()
    return float(above_m) if above_m > 1.01 * size_m.min() else 0.0


def _like_the_largest(parts: Sequence[CutOff]) -> int:
    """How many others are as large and cut off as long: halves of one shape are."""
    first = parts[0]
    return sum(
        math.isclose(it.region.volume_m3, first.region.volume_m3, rel_tol=ALIKE)
        and math.isclose(it.cut_off_s, first.cut_off_s, rel_tol=ALIKE)
        for it in parts[1:]
    )


def _spots(frozen: Freezing) -> Table:
    """Hot spots that froze within the run."""
    axes = [Column(f"{name}, mm") for name in "yz"[: frozen.hot_spots_m.shape[1] - 1]]
    columns = (Column("hot spot at x, mm"), *axes, Column("frozen after, s"))
    rows = tuple(
        tuple(number_cell(v, 4) for v in (*(1e3 * place), time_s))
        for place, time_s in zip(frozen.hot_spots_m, frozen.hot_spot_s, strict=True)
        if math.isfinite(time_s)
    )
    return Table(columns, rows, (False,) * len(rows))


def _cut_off(fed: Feeding, dimensions: int, has_risers: bool) -> Table:
    """Liquid that is cut off."""
    volume, factor = ("area, mm²", 1e6) if dimensions == 2 else ("volume, mm³", 1e9)
    columns = (
        Column("liquid from, mm", False),
        Column("to, mm", False),
        Column(volume),
        Column("cut off after, s"),
        Column("flows until, s"),
        Column("path closes at, mm", False),
        Column(f"path to {'the nearest riser' if has_risers else 'what flows last'}, mm"),
    )

    rows = []
    for it in fed.cut_off:
        low, high, throat = (
            ", ".join(number(1e3 * v) for v in at_m) if np.isfinite(at_m).all() else "-"
            for at_m in (it.region.low_m, it.region.high_m, it.throat_m)
        )
        values = factor * it.region.volume_m3, it.cut_off_s, it.solid_s
        rows.append(cells(low, high, *values, throat, 1e3 * it.path_m))
    return Table(columns, tuple(rows), (False,) * len(rows))


def distance_from(solids: Sequence[Body]) -> DistanceM:
    """How far places are from the nearest of some solids, negative inside."""
    return lambda places_m: np.min([solid.distance_m(places_m) for solid in solids], axis=0)


def cast_scene(folder: Path, scenario: Solidification, fed: Feeding) -> dict[str, object] | None:
    """The casting for the 3D view, coloured by when it froze; None in two dimensions.

    Boxes stand round liquid that is cut off, and round what flows last.
    """
    if scenario.dimensions == 2:
        return None
    with np.load(folder / "fields.npz", allow_pickle=False) as file:
        melts, size_m = file["melts"], float(file["size_m"].min())
        place_m, frozen_s = file["position_m"][melts], file["frozen_s"][melts]
    known = frozen_s[np.isfinite(frozen_s)]
    if not len(known):
        return None
    low_s, high_s = float(known.min()), float(known.max())
    ends = f"frozen after {number(low_s)} s", f"{number(high_s)} s"
    field = SurfaceField("time of freezing", place_m, frozen_s, low_s, high_s, ends, size_m)
    low_m, high_m = np.array(scenario.box.low_m), np.array(scenario.box.high_m)
    late_m = place_m[~(frozen_s < LAST_SHARE * high_s)]
    boxes = [(it.region.low_m, it.region.high_m) for it in fed.cut_off[:MOST_BOXES]]
    boxes.append((late_m.min(axis=0), late_m.max(axis=0)))
    scene = solid_scene(solids_of(scenario), low_m, high_m, [field])
    return scene | {"marks": [_edges(low - low_m, high - low_m) for low, high in boxes]}


def _edges(low_m: NDArray[np.float64], high_m: NDArray[np.float64]) -> list[float]:
    """Ends of the twelve edges of a box, one after another."""
    corner = np.indices((2, 2, 2)).reshape(3, -1).T
    ends = [(i, i | 1 << k) for k in range(3) for i in range(8) if not i & 1 << k]
    return (low_m + corner[np.array(ends)] * (high_m - low_m)).round(6).ravel().tolist()
