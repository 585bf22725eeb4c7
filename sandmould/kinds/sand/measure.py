"""Measure every snapshot of a run: fill of tubes and cavities, density, contacts, bed, layers."""

from __future__ import annotations

import math
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd

from sandmould.analysis.cavity_fill import cavity_fill, cavity_voids, reached_share
from sandmould.analysis.coordination import contacts
from sandmould.analysis.deflection import fill_under
from sandmould.analysis.density import apparent_density
from sandmould.analysis.loose_zones import LooseSand, find_loose_sand
from sandmould.analysis.solid_fraction import (
    bed_surface_height_m,
    mean_solid_fraction,
    own_solid_fraction,
    solid_fraction_profile,
)
from sandmould.analysis.tube_fill import mixing_index, tube_fill
from sandmould.definition.run import LAST_MEASURED
from sandmould.engines.snapshot import Snapshot, scene_at, stored_snapshots
from sandmould.geometry.geometry import Cavity, Scene
from sandmould.kinds.sand.measures import seeks_loose_sand
from sandmould.kinds.sand.moments import MOMENTS, list_moments, nearest
from sandmould.kinds.sand.outflow import add_outflow, measure_outflow
from sandmould.runs.columns import OVERLAP_P99_FRACTION, STAGE, VIBRATION_TIME_S
from sandmould.runs.files import replaced
from sandmould.runs.products import TABLE_PERIODS
from sandmould.scenario.checks.cavities import free_share
from sandmould.scenario.drive import BoxDrive, laid_down_drive, steady_drive
from sandmould.scenario.scenario import Scenario
from sandmould.scenario.stages import StageKind
from sandmould.scenario.vibration import VibrationStage

LOOSE_ZONES = "loose_zones.tsv"
_COLUMNS = (
    "x_from_m", "y_from_m", "z_from_m", "x_to_m", "y_to_m", "z_to_m", "volume_m3",
    "solid_fraction", "side", "near",
)  # fmt: skip
_NO_DRIVE = BoxDrive(np.nan, np.nan)


def measure_snapshot(scenario: Scenario, snapshot: Snapshot) -> dict[str, Any]:
    """One row of ``measures.tsv``; every column carries its unit.

    The solid fraction is taken from the floor to the mean surface of the bed.
    """
    scene, position, radius = (
        scene_at(scenario, snapshot), snapshot.position_m, snapshot.radius_m
    )  # fmt: skip
    row: dict[str, Any] = {
        "time_s": snapshot.time_s,
        "vibration_time_s": snapshot.vibration_time_s,
        "stage": snapshot.stage,
        "grains": len(radius),
    }
    unit = "m2" if scenario.dimension == 2 else "m3"
    for bore in scene.bores:
        fill = tube_fill(position, radius, bore)
        row[f"{bore.name}_fill_fraction"] = fill.fill_fraction
        row[f"{bore.name}_sand_{unit}"] = fill.sand_measure
        row[f"{bore.name}_front_depth_m"] = fill.front_depth_m
        row[f"{bore.name}_grains"] = fill.grains_inside
    surface = bed_surface_height_m(position, radius, scene)
    density = apparent_density(position, radius, scenario.sand.density_kg_m3, scene)
    touching = contacts(position, radius, scene)
    row |= {
        "bed_height_m": surface,
        "solid_fraction": mean_solid_fraction(position, radius, scene, 0.0, surface),
        "apparent_density_raw_kg_m3": float(np.mean(density.raw_kg_m3)),
        "apparent_density_corrected_kg_m3": float(np.nanmean(density.corrected_kg_m3)),
        "coordination": touching.mean_coordination,
        "coordination_bearing": touching.mean_coordination_bearing,
        "bearing_fraction": touching.bearing_fraction,
        "largest_overlap_fraction": touching.largest_overlap_fraction,
        OVERLAP_P99_FRACTION: touching.overlap_p99_fraction,
        "layer_mixing_index": mixing_index(position, snapshot.layer),
    }
    grain_m = scenario.sand.mass_median_diameter_m
    own = own_solid_fraction(position, radius, scene, grain_m)
    packed = row["bed_solid_fraction"] = own if math.isfinite(own) else row["solid_fraction"]
    for number, cavity in enumerate(scene.cavities):
        row |= _measure_cavity(scenario, snapshot, scene, cavity, number, packed)
    for bore in scenario.scene.bores:
        filled = row[f"{bore.name}_fill_fraction"]
        row[f"{bore.name}_fill_of_bed_fraction"] = filled / packed if packed else math.nan
    if snapshot.pattern_m is not None and scenario.dimension == 2:
        row["pattern_under_fraction"] = fill_under(snapshot.pattern_m, position, radius)
    return row | measure_outflow(scenario, snapshot)


def _measure_cavity(
    scenario: Scenario,
    snapshot: Snapshot,
    scene: Scene,
    cavity: Cavity,
    number: int,
    packed: float,
) -> dict[str, float]:
    """Columns of one cavity, by its number, beside sand of a bed's own solid fraction."""
    position, radius, name = snapshot.position_m, snapshot.radius_m, cavity.name
    grain_m = scenario.sand.mass_median_diameter_m
    unit = "m2" if scenario.dimension == 2 else "m3"
    free = free_share(scenario, number)
    fits = packed * reached_share(cavity, scenario.scene, grain_m)
    fill = cavity_fill(position, radius, cavity, grain_m, packed)
    voids = cavity_voids(position, radius, cavity, scene, grain_m)
    return {
        f"{name}_fill_fraction": fill.fill_fraction / free,
        f"{name}_fill_of_bed_fraction": fill.fill_fraction / fits if fits else math.nan,
        f"{name}_sand_{unit}": fill.sand_measure,
        f"{name}_grains": fill.grains_inside,
        f"{name}_filled_depth_m": fill.filled_depth_m,
        f"{name}_voids": voids.count,
        f"{name}_void_fraction": voids.void_fraction / free,
        f"{name}_largest_void_{unit}": voids.largest_measure,
    }


def measure_sand(scenario: Scenario, folder: Path) -> None:
    """Write all that is measured on the snapshots of a run's folder."""
    loose = last_loose_sand(scenario, folder)
    if loose is not None:
        write_loose_zones(loose, folder / LOOSE_ZONES)
    write_profile(scenario, folder, folder / "profile.tsv")
    if scenario.pattern is not None:
        from sandmould.kinds.sand.bent_files import write_bent  # scikit-fem: few studies need it

        write_bent(scenario, folder, folder / "exports")
    write_measures(scenario, folder, folder / LAST_MEASURED, loose)


def write_profile(scenario: Scenario, folder: Path, out: Path) -> None:
    """Write the solid fraction against height at the moments of the vibration.

    Slabs are as high as the largest grain; where a slab lies above the bed it holds little.
    """
    slab_m = scenario.largest_diameter_m
    edges_m = np.arange(0.0, scenario.box.height_m + slab_m / 2, slab_m)
    moments = list_moments(folder)
    rows = []
    for heading, share in MOMENTS.items() if moments else ():
        moment = nearest(moments, share * moments[-1].vibration_time_s)
        snapshot = moment.load()
        profile = solid_fraction_profile(
            snapshot.position_m, snapshot.radius_m, scene_at(scenario, snapshot), edges_m
        )
        for height_m, fraction in zip(profile.height_m, profile.solid_fraction, strict=True):
            rows.append((heading, snapshot.vibration_time_s, height_m, fraction))
    columns = ["moment", "vibration_time_s", "height_m", "solid_fraction"]
    pd.DataFrame(rows, columns=columns).to_csv(out, sep="\t", index=False, float_format="%.6g")


def write_measures(
    scenario: Scenario, folder: Path, out: Path, loose: LooseSand | None = None
) -> None:
    """Measure all snapshots of a run into a table, and take in what lies loose in the last one.

    A snapshot that cannot be read leaves a row of gaps that names it, not an error: the run's
    other rows stay good.
    """
    bent = None
    if scenario.pattern is not None:
        from sandmould.kinds.sand.bending import (  # scikit-fem: few studies need it
            BentPattern,
            add_loop,
        )

        bent = BentPattern(scenario)
    rows = []
    for stored in stored_snapshots(folder):
        try:
            snapshot = stored.load()
            row = measure_snapshot(scenario, snapshot)
            rows.append(row if bent is None else row | bent.row(snapshot))
        except ValueError as error:
            rows.append({"stage": f"unreadable: {error}"})
    columns = ["time_s", "vibration_time_s", "stage", "grains"]
    table = pd.DataFrame(rows) if rows else pd.DataFrame(columns=columns)
    table = add_drive(scenario, add_outflow(table, folder), folder)
    if bent is not None:
        table = add_loop(table, folder, bent.reach_m)
    table = add_loose_sand(table, loose)
    with replaced(out) as partial:
        table.to_csv(partial, sep="\t", index=False, float_format="%.8g")


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


def add_drive(scenario: Scenario, table: pd.DataFrame, folder: Path) -> pd.DataFrame:
    """Add the amplitudes of the box's motion up to each snapshot.

    ``table``: measures of a run's snapshots, in order of time.

    Gaps stand before the first vibration; in a rest, the amplitudes of the vibration before it.
    """
    if not scenario.vibrations:
        return table
    path = folder / TABLE_PERIODS
    periods = pd.read_csv(path, sep="\t") if path.exists() else None
    stages = {
        StageKind.VIBRATE.numbered(number): stage
        for number, stage in enumerate(scenario.vibration, start=1)
        if isinstance(stage, VibrationStage)
    }
    drives, current = [], ""
    for name, time_s in zip(table[STAGE], table[VIBRATION_TIME_S], strict=True):
        current = str(name) if str(name) in stages else current
        drive = _drive(current, stages[current], time_s, periods) if current else _NO_DRIVE
        drives.append(drive.columns())
    columns = pd.DataFrame(drives, columns=list(_NO_DRIVE.columns()), index=table.index)
    return pd.concat([table, columns], axis=1)


def _drive(
    name: str, stage: VibrationStage, time_s: float, periods: pd.DataFrame | None
) -> BoxDrive:
    """Amplitudes of a stage up to a time of vibration."""
    if stage.unbalance is None:
        return laid_down_drive(stage)
    if periods is None:
        return _NO_DRIVE
    # Half a period: the clock of a snapshot and the end of a period differ by round-off.
    until_s = time_s + 0.5 / stage.frequency_hz
    ended = periods[(periods[STAGE] == name) & (periods[VIBRATION_TIME_S] <= until_s)]
    values = (ended[c].to_numpy(dtype=np.float64) for c in ("displacement_m", "phase_deg"))
    return steady_drive(stage, *values) or _NO_DRIVE
