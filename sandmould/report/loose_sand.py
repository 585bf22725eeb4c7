"""What the report says of loose sand round the obstacles of a 3D scene."""

from __future__ import annotations

import math
from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

from sandmould.kinds.sand.measures import seeks_loose_sand
from sandmould.kinds.sand.moments import list_moments
from sandmould.report.tables import Cell, Column, Table
from sandmould.runs.formatting import number
from sandmould.runs.templates import sentences
from sandmould.scenario.scenario import Scenario

if TYPE_CHECKING:
    from sandmould.analysis.loose_zones import LooseZone

_LISTED = 8
_SIDES = {"under": "straight under", "over": "straight over", "beside": "beside"}


def loose_sand_pages(
    folder: Path, run: str, scenario: Scenario, height_m: float
) -> dict[str, Any] | None:
    """Say and draw where sand lies loose in a run; None where that is not sought.

    ``scenario``: its grains are the measure of a zone.
    """
    if not run or not seeks_loose_sand(scenario):
        return None
    from sandmould.analysis.loose_zones import LOOSE
    from sandmould.drawing.loose_field import (  # scipy: few need it
        LEAST,
        MOST,
        draw_loose_field,
        on_surfaces,
    )
    from sandmould.kinds.sand.loose import last_loose_sand

    loose = last_loose_sand(scenario, folder / "runs" / run)
    if loose is None:
        return None
    # where nothing is near, a zone is as large as chance and corners make it
    far_m3 = max((zone.measure for zone in loose.zones if zone.side == "away"), default=0.0)
    numbers = [
        place
        for place, zone in enumerate(loose.zones, start=1)
        if zone.side != "away" and zone.measure > far_m3
    ][:_LISTED]
    said = sentences(
        "loose.j2",
        near=[
            f"{number(100 * share, 2)} % of the places {_SIDES[side]} the obstacles"
            for side, share in loose.side_fraction.items()
            if side in _SIDES and math.isfinite(share)
        ],
        far=loose.side_fraction["away"],
        far_m3=far_m3,
        listed_zones=len(numbers),
        more=len(loose.zones) - len(numbers),
    )
    last = list_moments(folder / "runs" / run)[-1].load()
    return {
        "sentences": said,
        "picture": draw_loose_field(loose.field, numbers, last, scenario, height_m),
        "surface": on_surfaces(loose.field),
        "ends": (LEAST, MOST),
        "loose": LOOSE,
        "table": _table([loose.zones[place - 1] for place in numbers], scenario),
    }


def _table(zones: Sequence[LooseZone], scenario: Scenario) -> Table:
    grain_m3 = math.pi / 6 * scenario.sand.mass_median_diameter_m**3
    columns = (
        Column("no."), Column("where", False), Column("x, mm"), Column("y, mm"), Column("z, mm"),
        Column("volume, mm³"), Column("volume of grains"), Column("solid fraction"),
    )  # fmt: skip
    rows = []
    for place, zone in enumerate(zones, start=1):
        where = f"{'in' if zone.is_inside else zone.side} the {zone.near.replace('_', ' ')}"
        cells = [Cell(str(place), str(place)), Cell(where, where)]
        for low, high in zip(1e3 * zone.low_m, 1e3 * zone.high_m, strict=True):
            cells.append(Cell(f"{low:.0f} to {high:.0f}", str(low)))
        values = (1e9 * zone.measure, zone.measure / grain_m3, zone.solid_fraction)
        rows.append((*cells, *(Cell(number(value, 3), str(value)) for value in values)))
    return Table(columns, tuple(rows), (False,) * len(rows))
