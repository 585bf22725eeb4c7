"""What grains can cover of a cavity, against the exact measure of its edges."""

from __future__ import annotations

import numpy as np
import pytest

from sandmould.analysis.cavity_fill import reached_share
from sandmould.scenario.scenario import Scenario


def pit(dimension: int, **keys: object) -> Scenario:
    """A box of which the lowest 30 mm are a cavity, grains of one size, 4 mm."""
    size_m = (0.04, 0.02, 0.03) if dimension == 3 else (0.04, 0.03)
    return Scenario.model_validate(
        {
            "dimension": dimension,
            "box": {"width_m": 0.04, "depth_m": 0.02, "height_m": 0.1},
            "sand": {"size_classes": 1, "size_scale": 4, "sieve": [
                {"opening_m": 0.000999, "passing_fraction": 0.0},
                {"opening_m": 0.001001, "passing_fraction": 1.0},
            ]},
            "cavities": [{"kind": "box", "name": "pit", "size_m": size_m,
                          "centre_m": [0.5 * edge_m for edge_m in size_m]}],
            **keys,
        }
    )  # fmt: skip


def reached(scene: Scenario) -> float:
    return reached_share(scene.scene.cavities[0], scene.scene, scene.sand.mass_median_diameter_m)


def test_grains_reach_all_but_sharp_edges() -> None:
    # Round the centre of a grain in an edge lies a square, of which a quarter of a disc is reached.
    r = 0.5 * pit(2).sand.mass_median_diameter_m
    assert r == pytest.approx(0.002, rel=1e-3)
    edge = (1.0 - np.pi / 4.0) * r**2
    exact = 1.0 - 2.0 * edge / (0.04 * 0.03)
    assert reached(pit(2)) == pytest.approx(exact, abs=0.001)
    along_m = 2 * (0.04 - 2 * r) + 2 * (0.02 - 2 * r) + 4 * (0.03 - r)
    corners = 4.0 * (1.0 - np.pi / 6.0) * r**3
    exact = 1.0 - (edge * along_m + corners) / (0.04 * 0.02 * 0.03)
    # What is covered ends within a fraction of a cell, an eighth of a grain, of where it should.
    assert reached(pit(3)) == pytest.approx(exact, abs=0.005)


@pytest.mark.parametrize(("gap_m", "share"), [(0.0036, 0.5), (0.0044, 0.97)])
def test_what_lies_behind_a_gap_narrower_than_a_grain_is_not_reached(
    gap_m: float, share: float
) -> None:
    wide_m = 0.5 * (0.04 - gap_m)
    shelves = [
        {"kind": "plate", "name": name, "centre_m": [x_m, 0.015], "size_m": [wide_m, 0.0004]}
        for name, x_m in (("left", 0.5 * wide_m), ("right", 0.04 - 0.5 * wide_m))
    ]
    assert reached(pit(2, obstacles=shelves)) == pytest.approx(share, abs=0.02)
