"""Measures of sand that flows out of a hopper, on grains placed by hand."""

from __future__ import annotations

import math
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd
import pytest

from sandmould.kinds.sand.outflow import (
    add_outflow,
    measure_outflow,
    outflow_time_s,
    side_load_fraction,
    slopes,
)
from tests.hopper import (
    BOX_WIDTH_M,
    DEEP,
    DEPTH_M,
    FLOOR_M,
    HALF_INSIDE_M,
    HALF_OUTLET_M,
    LARGEST_M,
    MIDDLE_M,
    WALL_M,
    grains_at,
    hopper_scene,
    lattice,
)
from tests.scenes import tube_scene

R = 1.6e-3
TOP_M = FLOOR_M + WALL_M / 2
DAM: dict[str, Any] = {
    "obstacles": [
        {"kind": "plate", "name": "gate", "centre_m": [0.06, 0.06], "size_m": [WALL_M, 0.12]}
    ],
    "fill": {"over_x_m": [0.0, 0.058]},
}


@pytest.mark.parametrize("dimension", [2, 3])
def test_outflow_counts_the_sand_below_the_gate_by_its_measure(dimension: int) -> None:
    depth = [DEPTH_M / 2] if dimension == 3 else []
    heights, radius = [0.004, 0.0599, 0.0601, 0.1], np.array([2e-3, 1e-3, 1e-3, 2e-3])
    grains = np.array([[0.03 + 0.03 * i, *depth, z] for i, z in enumerate(heights)])
    scene = hopper_scene(**(DEEP if dimension == 3 else {}))
    for stage in ("discharge", "vibrate_1"):
        row = measure_outflow(scene, grains_at(grains, radius, stage))
        assert row["outflow_fraction"] == pytest.approx(0.5)
    # One grain more, which weighs as much as four or eight small ones.
    three = grains_at(grains[1:], radius[1:])
    assert measure_outflow(scene, three)["outflow_fraction"] == pytest.approx(
        1 / (2 + 2**dimension)
    )


def test_nothing_is_measured_before_the_opening_or_without_a_gate() -> None:
    grains = np.array([[0.02, 0.01], [0.1, 0.08]])
    for stage in ("settle_1", "between_1", "settle_2"):
        assert measure_outflow(hopper_scene(), grains_at(grains, R, stage)) == {}
    assert measure_outflow(tube_scene(), grains_at(grains, R, "vibrate_1")) == {}


def test_angles_of_heap_and_residue_are_those_that_were_laid() -> None:
    fine = hopper_scene(sand={"size_scale": 0.5})
    radius_m = fine.sand.classes(2)[-1].diameter_m / 2
    below = lattice((0.0, 0.0), (BOX_WIDTH_M, FLOOR_M - WALL_M), radius_m)
    apart = np.abs(below[:, 0] - MIDDLE_M)
    heap = below[below[:, 1] < 0.05 - apart * math.tan(math.radians(32.0))]
    inside = (MIDDLE_M - HALF_INSIDE_M, MIDDLE_M + HALF_INSIDE_M)
    above = lattice((inside[0], TOP_M), (inside[1], 0.1), radius_m)
    beside = np.abs(above[:, 0] - MIDDLE_M) - HALF_OUTLET_M
    stayed = above[above[:, 1] - TOP_M < beside * math.tan(math.radians(41.0))]
    row = measure_outflow(fine, grains_at(np.vstack([heap, stayed]), radius_m))
    # The steps of a grain over 100 grains of the heap, and over 37 of a shoulder.
    assert row["heap_angle_deg"] == pytest.approx(32.0, abs=0.5)
    assert row["residue_angle_deg"] == pytest.approx(41.0, abs=1.5)
    both = row["heap_angle_left_deg"], row["heap_angle_right_deg"]
    assert np.mean(both) == pytest.approx(row["heap_angle_deg"])
    assert 0.0 < row["heap_angle_se_deg"] < 1.0
    assert 0.0 < row["residue_angle_se_deg"] < 3.0
    assert row["heap_touches"] == ""
    assert row["outflow_fraction"] == pytest.approx(len(heap) / (len(heap) + len(stayed)))


def test_slopes_of_few_grains_are_no_angles() -> None:
    found = slopes(hopper_scene(), grains_at(np.array([[0.1, 0.002], [0.08, 0.07]]), R))
    assert all(math.isnan(slope.angle_deg) for slope in found)


@pytest.mark.parametrize(
    ("at_m", "dimension", "named"),
    [
        ([0.05, 0.15], 2, ""),
        ([0.0, 0.15], 2, "left"),
        ([0.15, BOX_WIDTH_M], 2, "right"),
        ([0.0, BOX_WIDTH_M], 2, "left and right"),
        ([0.0, 0.15], 3, "left and front and back"),
    ],
)
def test_walls_that_the_heap_leans_on_are_named(
    at_m: list[float], dimension: int, named: str
) -> None:
    depth = [(0.0, DEPTH_M)] if dimension == 3 else []
    low, high = zip(tuple(at_m), *depth, (0.0, 4 * LARGEST_M), strict=True)
    heap = lattice(low, high, R)
    # A single grain at the wall, and sand high up in the hopper, are no heap there.
    stray = np.array([[BOX_WIDTH_M - R, R], [R, 0.1], [MIDDLE_M, 0.1]])
    if dimension == 3:
        stray = np.insert(stray, 1, DEPTH_M / 2, axis=1)
    scene = hopper_scene(**(DEEP if dimension == 3 else {}))
    row = measure_outflow(scene, grains_at(np.vstack([heap, stray]), R))
    assert row["heap_touches"] == named
    angles = [v for column, v in row.items() if column.startswith("heap_angle")]
    assert len(angles) >= 2
    if named:
        assert all(math.isnan(v) for v in angles)


@pytest.mark.parametrize("mirrored", [False, True], ids=["to the right", "to the left"])
def test_run_out_counts_from_the_far_side_of_an_upright_gate(mirrored: bool) -> None:
    far_m, tip_m = 0.06 + WALL_M / 2, 0.14
    grains = np.vstack(
        [lattice((0.0, 0.0), (far_m, 0.05), R), lattice((far_m, 0.0), (tip_m, 0.02), R),
         [[0.18, R], [0.19, R]]]
    )  # fmt: skip
    changes = DAM
    if mirrored:
        grains[:, 0] = BOX_WIDTH_M - grains[:, 0]
        gate = DAM["obstacles"][0] | {"centre_m": [BOX_WIDTH_M - 0.06, 0.06]}
        changes = {"obstacles": [gate], "fill": {"over_x_m": [0.142, BOX_WIDTH_M]}}
    row = measure_outflow(hopper_scene(**changes), grains_at(grains, R))
    assert set(row) == {"outflow_fraction", "run_out_m", "heap_touches"}
    beyond = len(lattice((far_m, 0.0), (tip_m, 0.02), R)) + 2
    assert row["outflow_fraction"] == pytest.approx(beyond / len(grains))
    # Up to the tip, to a cell of one grain; the two that rolled on are no heap.
    assert row["run_out_m"] == pytest.approx(tip_m - far_m, abs=2 * R)


def test_no_sand_has_run_out_as_the_gate_opens() -> None:
    row = measure_outflow(hopper_scene(**DAM), grains_at(lattice((0, 0), (0.05, 0.05), R), R))
    assert row == {"outflow_fraction": 0.0, "run_out_m": 0.0, "heap_touches": ""}


@pytest.mark.parametrize("dimension", [2, 3])
def test_run_out_is_the_front_of_the_heap_and_not_sand_that_lies_apart(dimension: int) -> None:
    far_m, tip_m = 0.06 + WALL_M / 2, 0.12
    deep = [(0.0, DEPTH_M)] if dimension == 3 else []
    parts = [((0.0, far_m), 0.05), ((far_m, tip_m), 0.02), ((0.15, 0.165), 0.02)]
    grains = np.vstack(
        [lattice(*zip(along, *deep, (0.0, top_m), strict=True), R) for along, top_m in parts]
    )
    high = [0.17, *([DEPTH_M / 2] if dimension == 3 else []), 0.05]
    dam = DAM if dimension == 2 else DEEP | {
        "obstacles": [_upright_in_space(DAM["obstacles"][0])], "fill": DAM["fill"],
    }  # fmt: skip
    row = measure_outflow(hopper_scene(**dam), grains_at(np.vstack([grains, high]), R))
    # Neither the pile at 0.15 m nor the grain that flies over it: a gap parts both from the heap.
    assert row["run_out_m"] == pytest.approx(tip_m - far_m, abs=2 * R)
    assert row["heap_touches"] == ""


@pytest.mark.parametrize("wall", ["right", "left"])
def test_a_heap_at_the_far_wall_has_no_run_out(wall: str) -> None:
    grains = lattice((0.0, 0.0), (BOX_WIDTH_M, 0.02), R)
    changes = DAM
    if wall == "left":
        grains[:, 0] = BOX_WIDTH_M - grains[:, 0]
        gate = DAM["obstacles"][0] | {"centre_m": [BOX_WIDTH_M - 0.06, 0.06]}
        changes = {"obstacles": [gate], "fill": {"over_x_m": [0.142, BOX_WIDTH_M]}}
    row = measure_outflow(hopper_scene(**changes), grains_at(grains, R))
    assert math.isnan(row["run_out_m"])
    assert row["heap_touches"] == wall


def _upright_in_space(gate: dict[str, Any]) -> dict[str, Any]:
    """A gate of 2D over the depth of a box in 3D."""
    centre, size = gate["centre_m"], gate["size_m"]
    return gate | {
        "centre_m": [centre[0], DEPTH_M / 2, centre[1]], "size_m": [size[0], DEPTH_M, size[1]],
    }  # fmt: skip


def measured(fractions: list[float], opened_s: float = 1.0) -> pd.DataFrame:
    """Measures of two snapshots of the fill and, from the opening on, one every 0.1 s."""
    flow = [{"time_s": opened_s + 0.1 * i, "stage": "discharge", "outflow_fraction": f}
            for i, f in enumerate(fractions)]  # fmt: skip
    fill = [{"time_s": t, "stage": "settle_1"} for t in (0.5, opened_s)]
    return pd.DataFrame([*fill, *flow])


def test_outflow_takes_as_long_as_nineteen_twentieths_of_it() -> None:
    # 95 % of 0.6 is 0.57, nine tenths of the way from 0.3 to 0.6.
    assert outflow_time_s(measured([0.0, 0.3, 0.6, 0.6])) == pytest.approx(0.19)
    # A grain that bounces back over the edge takes nothing away.
    assert outflow_time_s(measured([0.0, 0.58, 0.56, 0.6])) == pytest.approx(0.1 * 0.57 / 0.58)
    # A snapshot that could not be read leaves a gap.
    gap = measured([0.0, 0.3, math.nan, 0.6])
    assert outflow_time_s(gap) == pytest.approx(0.1 + 0.2 * 0.9)


def test_sand_that_did_not_flow_took_no_time() -> None:
    assert math.isnan(outflow_time_s(measured([0.0, 0.0])))
    assert math.isnan(outflow_time_s(measured([math.nan])))


def loads_table(rows: list[tuple[float, str, str, float, float]]) -> pd.DataFrame:
    columns = ["time_s", "stage", "surface", "force_x_n", "force_y_n"]
    return pd.DataFrame(rows, columns=columns)


LOADS = loads_table([
    (0.1, "settle_1", "left", -9.0, -9.0),
    (0.2, "settle_2", "left", -1.0, -1.0),
    (0.2, "settle_2", "right", 2.0, -1.0),
    (0.2, "settle_2", "gate", 0.0, -8.0),
    (0.3, "discharge", "left", -7.0, -1.0),
])  # fmt: skip


def test_side_load_is_that_of_the_last_window_of_the_fill_over_the_weight() -> None:
    assert side_load_fraction(LOADS) == pytest.approx((1.0 + 2.0) / (1.0 + 1.0 + 8.0))
    spheres = LOADS.assign(force_y_n=0.5, force_z_n=LOADS.force_y_n)
    # Three of its rows press 0.5 N each in the other horizontal direction.
    assert side_load_fraction(spheres) == pytest.approx((1.0 + 2.0 + 3 * 0.5) / 10.0)
    assert math.isnan(side_load_fraction(LOADS.assign(force_y_n=0.0)))
    assert math.isnan(side_load_fraction(LOADS[LOADS.stage == "discharge"]))


def test_what_only_the_whole_run_tells_is_added_to_all_rows(tmp_path: Path) -> None:
    LOADS.to_csv(tmp_path / "loads.tsv", sep="\t", index=False)
    table = add_outflow(measured([0.0, 0.3, 0.6]), tmp_path)
    assert set(table.outflow_time_s.round(9)) == {0.19}
    assert set(table.side_load_fraction.round(9)) == {0.3}
    vibrated = pd.DataFrame([{"time_s": 0.1, "stage": "vibrate_1"}])
    assert add_outflow(vibrated, tmp_path) is vibrated
