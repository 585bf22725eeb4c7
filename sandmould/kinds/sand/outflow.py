"""Measures of sand that flows out through a gate: angles, how much, how fast, how far."""

from __future__ import annotations

import math
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd
from numpy.typing import NDArray

from sandmould.analysis.repose import (
    Slope,
    Surface,
    connected,
    free_surface,
    heap_slope,
    lying,
    residue_slope,
    walls_touched,
)
from sandmould.engines.snapshot import Snapshot
from sandmould.scenario.box import Plate
from sandmould.scenario.scenario import Scenario
from sandmould.scenario.stages import is_filling

COLUMN_WIDTH = {2: 1.0, 3: 0.5}
"""Columns in 2D or rings in 3D that a surface is averaged over, in largest diameters: a ring holds
more points, and a cone of as many grains is lower."""
HEAP_DEPTH = 1.5
"""Sand deeper than this, in largest diameters, is a heap and no single grain that rolled away."""
FLOWN_OUT = 0.95
"""Share of all that flows out at which the flow counts as over: the last grains trickle."""


def slopes(scenario: Scenario, snapshot: Snapshot) -> tuple[Slope, Slope]:
    """Slopes of the heap on the floor and of what stays in the hopper over a level gate."""
    gate = scenario.gate
    assert gate is not None
    axis = np.array(gate.centre_m[:-1])
    width_m = COLUMN_WIDTH[scenario.dimension] * scenario.largest_diameter_m
    pouring = np.array(scenario.pouring_m)
    hopper = free_surface(
        snapshot.position_m,
        snapshot.radius_m,
        pouring[:, 0],
        pouring[:, 1],
        gate.centre_m[-1] + gate.size_m[-1] / 2,
    )
    heap = _heap_surface(scenario, gate, snapshot)
    return heap_slope(heap, width_m, axis), residue_slope(hopper, width_m, axis)


def measure_outflow(scenario: Scenario, snapshot: Snapshot) -> dict[str, Any]:
    """Columns of one snapshot after the gate has opened; empty before, and without a gate."""
    gate = scenario.gate
    if gate is None or is_filling(snapshot.stage):
        return {}
    return (_heap if gate.is_level else _run_out)(scenario, gate, snapshot)


def _heap(scenario: Scenario, gate: Plate, snapshot: Snapshot) -> dict[str, Any]:
    """What fell through an outlet, and what stayed round it."""
    heap, stayed = slopes(scenario, snapshot)
    surface = _heap_surface(scenario, gate, snapshot)
    touched = walls_touched(surface, *_floor(scenario), HEAP_DEPTH * scenario.largest_diameter_m)
    row: dict[str, Any] = {
        "outflow_fraction": _share(snapshot, _fallen(gate, snapshot)),
        "heap_angle_deg": heap.angle_deg,
        "heap_angle_se_deg": heap.se_deg,
    }
    if scenario.dimension == 2:
        row |= {f"heap_angle_{flank.name}_deg": flank.angle_deg for flank in heap.flanks}
    if touched:
        # A wall holds this slope: it is no angle of repose.
        row |= {column: math.nan for column in row if column.startswith("heap_angle")}
    return row | {
        "heap_touches": " and ".join(touched),
        "residue_angle_deg": stayed.angle_deg,
        "residue_angle_se_deg": stayed.se_deg,
    }


def _run_out(scenario: Scenario, gate: Plate, snapshot: Snapshot) -> dict[str, Any]:
    """How far a column ran out beyond its gate; sand poured on its right runs to the left.

    The run-out is the front of the heap that hangs together with the sand at the gate: from the
    far side of the gate to the last place deeper than ``HEAP_DEPTH``. Grains that rolled or flew on
    are no part of it. Where that heap leans on the far wall the run-out is NaN: the wall
    stopped it.
    """
    way = 1.0 if sum(scenario.pouring_m[0]) < 2 * gate.centre_m[0] else -1.0
    far_side = way * gate.centre_m[0] + gate.size_m[0] / 2
    depth_m = HEAP_DEPTH * scenario.largest_diameter_m
    surface = _surface_of(scenario, snapshot, np.ones(len(snapshot.id), dtype=bool))
    along = way * surface.point_m[:, 0]
    heap = connected(surface, depth_m, along < far_side + scenario.largest_diameter_m)
    front = float(along[heap].max(initial=far_side))
    beyond = heap & (along > far_side)
    of_heap = Surface(surface.point_m[beyond], surface.height_m[beyond])
    far_wall = "right" if way > 0.0 else "left"
    touches = far_wall in walls_touched(of_heap, *_floor(scenario), depth_m)
    out = way * snapshot.position_m[:, 0] > far_side
    return {
        "outflow_fraction": _share(snapshot, out),
        "run_out_m": math.nan if touches else front - far_side,
        "heap_touches": far_wall if touches else "",
    }


def _fallen(gate: Plate, snapshot: Snapshot) -> NDArray[np.bool_]:
    """Which grains are below the middle of a level gate."""
    below: NDArray[np.bool_] = snapshot.position_m[:, -1] < gate.centre_m[-1]
    return below


def _share(snapshot: Snapshot, chosen: NDArray[np.bool_]) -> float:
    """Mass of some grains over that of all."""
    sand = snapshot.radius_m ** snapshot.position_m.shape[1]
    return float(sand[chosen].sum() / sand.sum())


def _heap_surface(scenario: Scenario, gate: Plate, snapshot: Snapshot) -> Surface:
    """Top of the sand on the floor, without grains that still fall."""
    position, radius = snapshot.position_m, snapshot.radius_m
    fallen = np.flatnonzero(_fallen(gate, snapshot))
    return _surface_of(scenario, snapshot, fallen[lying(position[fallen], radius[fallen], 0.0)])


def _surface_of(
    scenario: Scenario, snapshot: Snapshot, chosen: NDArray[np.bool_] | NDArray[np.int64]
) -> Surface:
    """Top of some grains over the whole floor."""
    position, radius = snapshot.position_m[chosen], snapshot.radius_m[chosen]
    return free_surface(position, radius, *_floor(scenario), 0.0)


def outflow_time_s(table: pd.DataFrame) -> float:
    """Time from the opening of the gate until most of what flows out is out.

    ``table``: rows of ``measures.tsv`` in order of time.

    Returns
    -------
    float, s
        NaN where nothing flowed.
    """
    flow = table[table["outflow_fraction"].notna()]
    if flow.empty or not flow["outflow_fraction"].iloc[-1] > 0.0:
        return math.nan
    before = table["time_s"][table.index < flow.index[0]]
    opened_s = float(before.iloc[-1]) if len(before) else float(flow["time_s"].iloc[0])
    time_s = np.concatenate([[opened_s], flow["time_s"]])
    share = np.concatenate([[0.0], flow["outflow_fraction"] / flow["outflow_fraction"].iloc[-1]])
    return float(np.interp(FLOWN_OUT, np.maximum.accumulate(share), time_s)) - opened_s


def side_load_fraction(loads: pd.DataFrame) -> float:
    """Horizontal forces of the filled sand on all that holds it over its weight on the floors.

    ``loads``: ``loads.tsv`` of a run; the last window before the gate opens is taken.
    """
    filled = loads[loads["stage"].map(is_filling).astype(bool)]
    last = filled[filled["time_s"] == filled["time_s"].max()]
    columns = [c for c in last.columns if c.startswith("force_")]
    weight_n = -float(last[columns[-1]].sum())
    sideways_n = float(last[columns[:-1]].abs().to_numpy().sum())
    return sideways_n / weight_n if weight_n > 0.0 else math.nan


def _floor(scenario: Scenario) -> tuple[np.ndarray, np.ndarray]:
    """Bounds of the box's floor, (d - 1,) float64, m."""
    size = np.array([scenario.box.width_m, scenario.box.depth_m])[: scenario.dimension - 1]
    return np.zeros_like(size), size


def add_outflow(table: pd.DataFrame, folder: Path) -> pd.DataFrame:
    """Add what only the whole run tells to all rows of its measures."""
    if "outflow_fraction" not in table:
        return table
    loads = pd.read_csv(folder / "loads.tsv", sep="\t")
    return table.assign(
        outflow_time_s=outflow_time_s(table), side_load_fraction=side_load_fraction(loads)
    )
