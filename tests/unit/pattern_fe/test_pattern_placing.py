"""Patterns that cannot stand where they are put, told before anything starts."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import pytest

from sandmould.bad_input import BadInputError
from sandmould.pattern_fe.coupling.interface import with_surface
from sandmould.pattern_fe.shapes import bar, mesh_of
from sandmould.scenario.scenario import Scenario
from tests.patterns import write_mesh

BAR: dict[str, Any] = {
    "shape": {"kind": "bar", "width_m": 0.04, "height_m": 0.006},
    "position_m": [0.0, 0.02],
    "supports": {"clamped": ["left"]},
}


def plank(obstacle: dict[str, Any], **scene: Any) -> Scenario:
    tree = {"box": {"width_m": 0.1, "height_m": 0.1}, "pattern": BAR, "obstacles": [obstacle]}
    return with_surface(Scenario.model_validate(tree | scene))


def plate(x_m: float, y_m: float, width_m: float, height_m: float) -> dict[str, Any]:
    return {"kind": "plate", "centre_m": [x_m, y_m], "size_m": [width_m, height_m]}


@pytest.mark.parametrize(
    "obstacle",
    [
        plate(0.02, 0.023, 0.002, 0.002),  # inside
        plate(0.04, 0.02, 0.01, 0.01),  # at a corner
        plate(0.0213, 0.023, 0.0004, 0.03),  # through it, between two vertices
        plate(0.05, 0.03, 0.1, 0.05),  # round it
        {"kind": "polygon", "vertices_m": [[0.02, 0.01], [0.03, 0.01], [0.0263, 0.0203]]},
    ],
)
def test_an_obstacle_that_reaches_into_a_pattern_is_told(obstacle: dict[str, Any]) -> None:
    with pytest.raises(BadInputError, match=r"pattern.position_m = .* clear of the obstacle '"):
        plank(obstacle)


@pytest.mark.parametrize("obstacle", [plate(0.02, 0.015, 0.02, 0.01), plate(0.06, 0.05, 0.01, 0.1)])
def test_an_obstacle_may_touch_a_pattern_or_stand_beside_it(obstacle: dict[str, Any]) -> None:
    assert plank(obstacle).scene.outlines[0].name == "pattern"


def test_in_space_a_rod_through_a_pattern_is_told() -> None:
    told = {**BAR, "position_m": [0.0, 0.02, 0.02], "depth_m": 0.02, "element_m": 0.01}
    rod = {"kind": "cylinder", "centre_m": [0.0213, 0.03, 0.02], "diameter_m": 0.001,
           "length_m": 0.03}  # fmt: skip
    box = {"width_m": 0.1, "depth_m": 0.06, "height_m": 0.1}
    with pytest.raises(BadInputError, match="clear of the obstacle 'cylinder'"):
        plank(rod, dimension=3, box=box, pattern=told)
    plank({**rod, "centre_m": [0.06, 0.03, 0.02]}, dimension=3, box=box, pattern=told)


def test_bad_obstacles_beside_a_pattern_are_told_as_alone() -> None:
    with pytest.raises(
        BadInputError, match=r"obstacles.0.centre_m = .* 2 numbers, one a dimension"
    ):
        plank({"kind": "plate", "centre_m": [0.02, 0.02, 0.02], "size_m": [0.002, 0.002]})


def test_a_pattern_smaller_than_a_grain_is_told_with_its_unit(tmp_path: Path) -> None:
    path = tmp_path / "arch.vtu"
    write_mesh(path, mesh_of(bar(0.11, 0.055), 0.01))  # in m, read as mm
    shape = {"kind": "file", "file": str(path), "unit_m": 0.001}
    says = r"pattern.shape.unit_m = 0.001 .* larger than the largest grain, .* it is 0.00011 by 5.5"
    with pytest.raises(BadInputError, match=says):
        plank(plate(0.06, 0.02, 0.01, 0.01), pattern={**BAR, "shape": shape})
    small = {"kind": "bar", "width_m": 1e-4, "height_m": 1e-4}
    with pytest.raises(BadInputError, match=r"pattern.shape = .* larger than the largest grain"):
        plank(plate(0.06, 0.02, 0.01, 0.01), pattern={**BAR, "shape": small})
