"""What the report says of loose sand round the obstacles of a scene."""

from __future__ import annotations

import math
from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from sandmould.engines.snapshot import scene_at
from sandmould.kinds.sand.moments import list_moments
from sandmould.report.tables import Cell, Column, Table, cells
from sandmould.runs.formatting import number
from sandmould.runs.templates import sentences
from sandmould.scenario.scenario import Scenario

if TYPE_CHECKING:
    from sandmould.analysis.loose_zones import LooseZone

_LISTED = 8
_MM = {2: 1e6, 3: 1e9}
"""mm2 or mm3."""
_SIDES = {"under": "straight under", "over": "straight over", "beside": "beside"}


def loose_sand_pages(
    folder: Path, run: str, scenario: Scenario, height_m: float
) -> dict[str, Any] | None:
    """Say and draw where sand lies loose in a run; None where that is not sought.

    ``scenario``: its grains are the measure of a zone.
    """
    if not run or not scenario.scene.solids or scenario.gate is not None:
        return None
    from sandmould.analysis.loose_zones import BALL_GRAINS, LOOSE, find_loose_sand
    from sandmould.drawing import loose_field

    moments = list_moments(folder / "runs" / run)
    if not moments:
        return None
    last, grain_m = moments[-1].load(), scenario.sand.mass_median_diameter_m
    # a bed of few grains may have none, in the median, at some distance from a wall
    with np.errstate(divide="ignore", invalid="ignore"):
        loose = find_loose_sand(last.position_m, last.radius_m, scene_at(scenario, last), grain_m)
    # where nothing is near, a zone is as large as chance and corners make it
    far = max((zone.measure for zone in loose.zones if zone.side == "away"), default=0.0)
    numbers = [
        place
        for place, zone in enumerate(loose.zones, start=1)
        if zone.side != "away" and zone.measure > far
    ][:_LISTED]
    said = sentences(
        "loose.j2",
        near=[
            f"{number(100 * share, 2)} % of the places {_SIDES[side]} the obstacles"
            for side, share in loose.side_fraction.items()
            if side in _SIDES and math.isfinite(share)
        ],
        far=loose.side_fraction["away"],
        far_mm=_MM[scenario.dimension] * far,
        unit="mm²" if scenario.dimension == 2 else "mm³",
        listed_zones=len(numbers),
        more=len(loose.zones) - len(numbers),
    )
    return {
        "sentences": said,
        "picture": loose_field.draw_loose_field(loose.field, numbers, last, scenario, height_m),
        "surface": loose_field.on_surfaces(loose.field) if scenario.dimension == 3 else None,
        "ends": (loose_field.LEAST, loose_field.MOST),
        "loose": LOOSE,
        "reach_mm": 1e3 * 0.5 * BALL_GRAINS * grain_m,
        "table": _table([loose.zones[place - 1] for place in numbers], scenario),
    }


def _table(zones: Sequence[LooseZone], scenario: Scenario) -> Table:
    flat, grain_m = scenario.dimension == 2, scenario.sand.mass_median_diameter_m
    grain = math.pi * (grain_m**2 / 4 if flat else grain_m**3 / 6)
    size, unit = ("area", "mm²") if flat else ("volume", "mm³")
    columns = (
        Column("no."), Column("where", False), Column("x, mm"), Column("y, mm"),
        *(() if flat else (Column("z, mm"),)),
        Column(f"{size}, {unit}"), Column(f"{size} over a grain's"), Column("solid fraction"),
    )  # fmt: skip
    rows = []
    for place, zone in enumerate(zones, start=1):
        where = f"{'in' if zone.is_inside else zone.side} the {zone.near.replace('_', ' ')}"
        ends = zip(1e3 * zone.low_m, 1e3 * zone.high_m, strict=True)
        box = (Cell(f"{low:.0f} to {high:.0f}", str(low)) for low, high in ends)
        values = (_MM[scenario.dimension] * zone.measure, zone.measure / grain, zone.solid_fraction)
        rows.append(cells(str(place), where, *box, *values))
    return Table(columns, tuple(rows), (False,) * len(rows))
