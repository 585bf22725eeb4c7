"""What holds sand over an outlet, told from grains placed by hand."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from sandmould.engines.rest import what_blocks
from tests.hopper import (
    BOX_WIDTH_M,
    DEEP,
    DEPTH_M,
    FLOOR_M,
    HALF_INSIDE_M,
    HALF_OUTLET_M,
    MIDDLE_M,
    WALL_M,
    grains_at,
    hopper_scene,
    lattice,
)
from tests.scenes import tube_scene

R = 1.6e-3
TOP_M, BOTTOM_M = FLOOR_M + WALL_M / 2, FLOOR_M - WALL_M / 2


def between(x_m: tuple[float, float], z_m: tuple[float, float], dimension: int) -> Any:
    """Grains that fill a rectangle, in 3D all of the slice behind it."""
    depth = [(0.0, DEPTH_M)] if dimension == 3 else []
    low, high = zip(x_m, *depth, z_m, strict=True)
    return lattice(low, high, R)


def in_hopper(dimension: int, hole_height_m: float) -> Any:
    """Sand in the hopper with an elliptic hole over the outlet."""
    inside = (MIDDLE_M - HALF_INSIDE_M, MIDDLE_M + HALF_INSIDE_M)
    bed = between(inside, (TOP_M, 0.14), dimension)
    across = (bed[:, 0] - MIDDLE_M) / HALF_OUTLET_M
    up = (bed[:, -1] - TOP_M) / hole_height_m
    return bed[across**2 + up**2 > 1]


def heap(dimension: int, peak_m: float) -> Any:
    """A heap of 20 degrees under the outlet."""
    bed = between((0.0, BOX_WIDTH_M), (0.0, 0.1), dimension)
    return bed[bed[:, -1] + R < peak_m - np.abs(bed[:, 0] - MIDDLE_M) * np.tan(np.radians(20.0))]


def wedges(dimension: int) -> Any:
    """What stays on the shoulders of a hopper that has run empty."""
    bed = in_hopper(dimension, hole_height_m=1e-6)
    beside = np.abs(bed[:, 0] - MIDDLE_M) - HALF_OUTLET_M
    return bed[bed[:, -1] - TOP_M < beside * np.tan(np.radians(40.0))]


def scene(dimension: int, **changes: Any) -> Any:
    return hopper_scene(**((DEEP if dimension == 3 else {}) | changes))


@pytest.mark.parametrize("hole_height_m", [0.01, 0.045], ids=["low", "higher than wide"])
@pytest.mark.parametrize("dimension", [2, 3])
def test_an_arch_is_named_with_the_width_of_the_outlet(
    dimension: int, hole_height_m: float
) -> None:
    grains = np.vstack([in_hopper(dimension, hole_height_m), heap(dimension, 0.01)])
    # In 3D the slice is narrower than the outlet is long.
    width, diameters = {2: ("0.032", "8.1"), 3: ("0.012", "3.1")}[dimension]
    assert what_blocks(scene(dimension), grains_at(grains, R)) == (
        f"an arch holds the sand over the outlet, which is {width} m wide, "
        f"{diameters} of the largest grains"
    )


@pytest.mark.parametrize("dimension", [2, 3])
def test_a_heap_grown_up_to_the_outlet_is_told_from_an_arch(dimension: int) -> None:
    grains = np.vstack([in_hopper(dimension, 0.003), heap(dimension, BOTTOM_M + 0.005)])
    assert what_blocks(scene(dimension), grains_at(grains, R)) == (
        "the heap has grown up to the outlet: raise the hopper or fill in less sand"
    )


@pytest.mark.parametrize("dimension", [2, 3])
def test_nothing_blocks_an_outlet_that_has_run_empty(dimension: int) -> None:
    depth = [DEPTH_M / 2] if dimension == 3 else []
    stray = np.array([[MIDDLE_M, *depth, TOP_M + R]])
    # A heap whose peak stands in the outlet has let all of the sand pass.
    for peak_m in (0.02, BOTTOM_M):
        grains = np.vstack([wedges(dimension), heap(dimension, peak_m), stray])
        assert what_blocks(scene(dimension), grains_at(grains, R)) == ""


def test_nothing_blocks_an_upright_gate_or_a_run_without_one() -> None:
    bed = grains_at(in_hopper(2, 0.01), R)
    assert what_blocks(hopper_scene(), bed) != ""
    dam = {"kind": "plate", "name": "gate", "centre_m": [0.1, 0.06], "size_m": [WALL_M, 0.12]}
    assert what_blocks(hopper_scene(obstacles=[dam]), bed) == ""
    assert what_blocks(tube_scene(), bed) == ""
