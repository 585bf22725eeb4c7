"""Loose sand round the solids of a 3D scene, when a run is at its end."""

from __future__ import annotations

from pathlib import Path

import pandas as pd

from sandmould.analysis.loose_zones import LooseSand, find_loose_sand
from sandmould.engines.snapshot import scene_at
from sandmould.kinds.sand.measures import seeks_loose_sand
from sandmould.kinds.sand.moments import list_moments
from sandmould.scenario.scenario import Scenario

LOOSE_ZONES = "loose_zones.tsv"
_COLUMNS = (
    "x_from_m", "y_from_m", "z_from_m", "x_to_m", "y_to_m", "z_to_m", "volume_m3",
    "solid_fraction", "side", "near",
)  # fmt: skip


def last_loose_sand(scenario: Scenario, folder: Path) -> LooseSand | None:
    """Find the loose sand of a run's last snapshot; None where none is sought, or there is none."""
    moments = list_moments(folder) if seeks_loose_sand(scenario) else ()
    if not moments:
        return None
    last = moments[-1].load()
    grain_m = scenario.sand.mass_median_diameter_m
    return find_loose_sand(last.position_m, last.radius_m, scene_at(scenario, last), grain_m)


def add_loose_sand(table: pd.DataFrame, loose: LooseSand | None) -> pd.DataFrame:
    """Put what was found into the last row of the measures."""
    if loose is None or table.empty:
        return table
    largest = loose.zones[0].measure if loose.zones else 0.0
    columns = {
        "loose_fraction": loose.loose_fraction,
        "loose_under_fraction": loose.side_fraction["under"],
        "loose_over_fraction": loose.side_fraction["over"],
        "loose_beside_fraction": loose.side_fraction["beside"],
        "loose_away_fraction": loose.side_fraction["away"],
        "loose_zones": len(loose.zones),
        "largest_loose_zone_m3": largest,
    }
    for name, value in columns.items():
        table.loc[table.index[-1], name] = value
    return table


def write_loose_zones(loose: LooseSand, out: Path) -> None:
    """Write a row a zone, the largest first."""
    rows = [(*z.low_m, *z.high_m, z.measure, z.solid_fraction, z.side, z.near) for z in loose.zones]
    table = pd.DataFrame(rows, columns=list(_COLUMNS))
    table.to_csv(out, sep="\t", index=False, float_format="%.6g")
