"""A bed that was never computed: planned grains, in the box, out of solids, hardly overlapping."""

from __future__ import annotations

from collections import Counter
from typing import Any

import numpy as np
import pytest
from scipy.spatial import cKDTree

from sandmould.scenario import likely_bed as module
from sandmould.scenario.likely_bed import LikelyBed, likely_bed
from sandmould.scenario.scenario import Scenario

TUBE = {
    "kind": "tube", "diameter_m": 0.03, "length_m": 0.05, "left_end_x_m": 0.05,
    "axis_height_m": 0.04, "section": "round",
}  # fmt: skip


def scene(dimension: int, *obstacles: dict[str, Any], **changes: Any) -> Scenario:
    """A box of 0.1 m with two layers."""
    told = {
        "dimension": dimension,
        "obstacles": obstacles,
        "sand": {"size_scale": 6 if dimension == 2 else 10, "size_classes": 3},
        "fill": {"layers": [{"count": 300}, {"count": 200}]},
    }
    return Scenario.model_validate(told | changes)


def overlaps(bed: LikelyBed) -> np.ndarray:
    """Overlaps of touching grains over the smaller radius."""
    pairs = cKDTree(bed.position_m).query_pairs(2 * bed.radius_m.max(), output_type="ndarray")
    apart_m = np.linalg.norm(bed.position_m[pairs[:, 0]] - bed.position_m[pairs[:, 1]], axis=1)
    radii_m = bed.radius_m[pairs]
    overlap = (radii_m.sum(axis=1) - apart_m) / radii_m.min(axis=1)
    return overlap[overlap > 0]


@pytest.mark.parametrize("dimension", [2, 3])
def test_planned_grains_lie_in_the_box_out_of_solids_and_cavities(dimension: int) -> None:
    s = scene(dimension, TUBE)
    bed = likely_bed(s)
    assert (bed.of_grains, bed.slice_m) == (500, None)
    assert Counter(bed.layer.tolist()) == {1: 300, 2: 200}
    sizes = Counter(np.round(2 * bed.radius_m, 9).tolist())
    for each in s.sand.classes(dimension):
        # each layer has its share, rounded
        assert sizes[round(each.diameter_m, 9)] == pytest.approx(500 * each.count_fraction, abs=2)
    # a drawing: what is seen are overlaps of a tenth of a radius and more
    room = s.scene.clearance_m(bed.position_m) / bed.radius_m
    assert room.min() > 0.85
    assert np.median(overlaps(bed)) < 0.05
    assert np.quantile(overlaps(bed), 0.98) < 0.35
    (bore,) = s.scene.bores
    depth_m, across_m = bore.local(bed.position_m)
    inside = (depth_m > 0.01) & (np.linalg.norm(across_m, axis=1) < 0.015)
    assert not inside.any()
    # the first layer is under the second one
    assert np.median(bed.position_m[bed.layer == 1, -1]) < np.quantile(
        bed.position_m[bed.layer == 2, -1], 0.02
    )


@pytest.mark.parametrize("dimension", [2, 3])
def test_a_cavity_that_is_named_stays_empty(dimension: int) -> None:
    size_m = [0.03, 0.02] if dimension == 2 else [0.03, 0.02, 0.02]
    centre_m = [0.05, 0.02] if dimension == 2 else [0.05, 0.025, 0.02]
    hole = {"kind": "box", "name": "hole", "centre_m": centre_m, "size_m": size_m}
    bed = likely_bed(scene(dimension, cavities=[hole]))
    away_m = np.abs(bed.position_m - centre_m) - np.array(size_m) / 2
    # the middle of a grain may be pushed no farther than to its border
    assert (away_m.max(axis=1) > 0.0).all()
    assert (bed.position_m[:, -1] < 0.015).any()


def test_sand_lies_on_what_it_cannot_pass() -> None:
    plank = {"kind": "plate", "centre_m": [0.05, 0.03], "size_m": [0.1, 0.01]}
    assert likely_bed(scene(2, plank)).position_m[:, 1].min() > 0.035
    short = plank | {"size_m": [0.06, 0.01]}
    assert likely_bed(scene(2, short)).position_m[:, 1].min() < 0.01


def test_of_too_many_grains_a_slice_is_as_dense(monkeypatch: pytest.MonkeyPatch) -> None:
    whole = likely_bed(scene(3))
    monkeypatch.setitem(module.MOST_DRAWN, 3, 250)
    part = likely_bed(scene(3), cut_m=0.02)
    assert (len(part.radius_m), part.of_grains) == (250, 500)
    assert part.slice_m == pytest.approx((0.02, 0.045))
    y = part.position_m[:, 1]
    assert 0.02 <= y.min() < y.max() <= 0.045
    heights_m = [np.quantile(bed.position_m[:, 2], 0.9) for bed in (whole, part)]
    assert heights_m[1] == pytest.approx(heights_m[0], rel=0.1)


def test_a_scene_is_drawn_alike_every_time() -> None:
    one, other = (likely_bed(scene(2)) for _ in range(2))
    assert np.array_equal(one.position_m, other.position_m)
    assert np.array_equal(one.radius_m, other.radius_m)
