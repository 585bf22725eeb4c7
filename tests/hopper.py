"""A small flat-bottomed hopper whose gate is taken away; sand flows out of no much smaller one."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from sandmould.engines.snapshot import Snapshot
from sandmould.scenario.reading import Origin, merge
from sandmould.scenario.scenario import Scenario
from tests.liggghts_scenes import SOFT, SPRINGS

BOX_WIDTH_M, MIDDLE_M = 0.2, 0.1
FLOOR_M, WALL_M, SIDE_HEIGHT_M = 0.06, 0.004, 0.09
"""Height of the middle of the hopper's floor, thickness of all plates, height of the sides."""
HALF_INSIDE_M, HALF_OUTLET_M = 0.034, 0.016
LARGEST_M = 0.0039
"""About the largest grain's diameter: an outlet of eight of them lets the sand flow."""
DEPTH_M = 0.012


def hopper_plates(half_outlet_m: float = HALF_OUTLET_M, dimension: int = 2) -> list[dict[str, Any]]:
    """Floor, gate and sides of the hopper; in 3D front and back of the box close it."""
    shoulder = HALF_INSIDE_M - half_outlet_m
    shoulder_at = (HALF_INSIDE_M + half_outlet_m) / 2
    side_at, side_middle = HALF_INSIDE_M + WALL_M / 2, FLOOR_M + (SIDE_HEIGHT_M - WALL_M) / 2
    plates = (
        ("floor_left", -shoulder_at, FLOOR_M, shoulder, WALL_M),
        ("gate", 0.0, FLOOR_M, 2 * half_outlet_m, WALL_M),
        ("floor_right", shoulder_at, FLOOR_M, shoulder, WALL_M),
        ("side_left", -side_at, side_middle, WALL_M, SIDE_HEIGHT_M),
        ("side_right", side_at, side_middle, WALL_M, SIDE_HEIGHT_M),
    )
    middle, depth = ([DEPTH_M / 2], [DEPTH_M]) if dimension == 3 else ([], [])
    return [
        {"kind": "plate", "name": name, "centre_m": [round(MIDDLE_M + x, 9), *middle, round(z, 9)],
         "size_m": [round(width, 9), *depth, height]}
        for name, x, z, width, height in plates
    ]  # fmt: skip


HOPPER: dict[str, Any] = {
    "box": {"width_m": BOX_WIDTH_M, "height_m": 0.16},
    "obstacles": hopper_plates(),
    "sand": {
        "disc_thickness_m": 0.1,
        "size_classes": 2,
        "disc_inertia": "sphere",
        "sieve": [
            {"opening_m": 0.7e-3, "passing_fraction": 0},
            {"opening_m": 1.1e-3, "passing_fraction": 1},
        ],
    },
    "contact": {
        "springs_at_size_scale": None,
        **{name: dict.fromkeys(SPRINGS, 1e4) for name in ("grain_grain", "grain_wall")},
    },
    "background_damping": {"form": "none"},
    # The first layer leaves gaps: grains of the second stand on the gate too.
    "fill": {
        "over_x_m": [round(MIDDLE_M - HALF_INSIDE_M, 9), round(MIDDLE_M + HALF_INSIDE_M, 9)],
        "layers": [{"count": 15}, {"count": 205}],
    },
    "rest": {"rms_speed_m_s": 0.05, "discharge_rms_speed_m_s": 0.02},
    "discharge": {"gate": "gate"},
    # Strokes of 2 mm: sand flows through the open gate again.
    "vibration": [
        {"acceleration_g": 3.0, "frequency_hz": 20.0, "duration_s": 0.15, "direction": "horizontal"}
    ],
    "record": {"snapshot_every_s": 0.02, "checkpoint_every_s": 0.04},
    "time_step": {"bed_fraction": 0.0},
}  # fmt: skip
"""What all engines can compute: no background damping, discs that turn as spheres do."""

DEEP: dict[str, Any] = {
    "dimension": 3,
    "box": {"depth_m": DEPTH_M},
    "obstacles": hopper_plates(dimension=3),
    "contact": SOFT,
    "time_step": {"fraction": 0.9},
    "fill": {"layers": [{"count": 200}]},
}
"""Changes for a slice of the hopper three grains deep."""


def hopper_scene(engine: str = "reference", **changes: Any) -> Scenario:
    """Make the hopper for an engine, with sections changed."""
    base = merge(HOPPER, {"engine": {"name": engine}}, Origin(), "test")
    return Scenario.model_validate(merge(base, changes, Origin(), "test"))


def grains_at(
    position_m: NDArray[np.float64], radius_m: float | NDArray[np.float64], stage: str = "discharge"
) -> Snapshot:
    """Grains at rest at given places, (n, d), all of a radius or each of its own."""
    n = len(position_m)
    one = np.ones(n, dtype=np.int64)
    return Snapshot(
        0.5, np.nan, stage, np.arange(1, n + 1), one, position_m, np.zeros_like(position_m),
        np.zeros((n, 3)), np.broadcast_to(radius_m, n).copy(),
    )  # fmt: skip


def lattice(low_m: tuple[float, ...], high_m: tuple[float, ...], radius_m: float) -> Any:
    """Centres, (n, d) float64, m, of touching grains on a square grid between two corners."""
    axes = [np.arange(low + radius_m, high - 0.999 * radius_m, 2 * radius_m)
            for low, high in zip(low_m, high_m, strict=True)]  # fmt: skip
    return np.stack(np.meshgrid(*axes, indexing="ij"), axis=-1).reshape(-1, len(axes))
