"""What the report says of loose sand round the obstacles of a 3D scene."""

from __future__ import annotations

import math
from pathlib import Path
from typing import Any

import pandas as pd

from sandmould.kinds.sand.measures import seeks_loose_sand
from sandmould.report.tables import Cell, Column, Table
from sandmould.runs.columns import RUN
from sandmould.runs.formatting import listed, number
from sandmould.scenario.scenario import Scenario

_LISTED = 8
_SIDES = {"under": "straight under", "over": "straight over", "beside": "beside"}


def loose_sand_pages(
    folder: Path, run: str, summary: pd.DataFrame, scenario: Scenario
) -> dict[str, Any] | None:
    """Say where sand lies loose in a run; None where that was not sought.

    Parameters
    ----------
    folder : Path
        Of the study.
    run : str
        The one that is pictured.
    summary : DataFrame
    scenario : Scenario
        Its grains are the measure of a zone.
    """
    if not run or not seeks_loose_sand(scenario):
        return None
    from sandmould.kinds.sand.loose import LOOSE_ZONES  # scipy: few reports need it

    path = folder / "runs" / run / LOOSE_ZONES
    if not path.is_file():
        return None
    row = summary.loc[summary[RUN] == run].iloc[0]
    shares = {side: float(row[f"loose_{side}_fraction"]) for side in (*_SIDES, "away")}
    near = [
        f"{_percent(shares[side])} of the places {words} the obstacles"
        for side, words in _SIDES.items()
        if math.isfinite(shares[side])
    ]
    sentence = f"Sand lies loose at {listed(near, most=len(_SIDES))}."
    if math.isfinite(shares["away"]):
        sentence += f" Farther away it is {_percent(shares['away'])}: corners, and chance."
    zones = pd.read_csv(path, sep="\t")
    more = len(zones) - _LISTED
    note = f"{more} smaller zones are in {LOOSE_ZONES} of the run." if more > 0 else ""
    return {"sentence": sentence, "table": _table(zones.head(_LISTED), scenario), "note": note}


def _percent(share: float) -> str:
    return f"{number(100 * share, 2)} %"


def _table(zones: pd.DataFrame, scenario: Scenario) -> Table:
    grain_m3 = math.pi / 6 * scenario.sand.mass_median_diameter_m**3
    columns = (
        Column("where", False), Column("middle x, y, z, mm"), Column("volume, mm³"),
        Column("volume of grains"), Column("solid fraction"),
    )  # fmt: skip
    rows = []
    for zone in zones.to_dict("records"):
        place = ", ".join(f"{1e3 * zone[axis]:.0f}" for axis in ("x_m", "y_m", "z_m"))
        cells = [Cell(zone["side"], zone["side"]), Cell(place, place)]
        values = (1e9 * zone["volume_m3"], zone["volume_m3"] / grain_m3, zone["solid_fraction"])
        rows.append((*cells, *(Cell(number(value, 3), str(value)) for value in values)))
    return Table(columns, tuple(rows), (False,) * len(rows))
