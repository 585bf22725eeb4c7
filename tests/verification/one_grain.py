"""One grain in LAMMPS, over the floor or over a slab: a plate of its own or a polygon of ours."""

from __future__ import annotations

from typing import Any

import numpy as np

from sandmould.engines.lammps.session import LammpsSession
from sandmould.scenario.scenario import Scenario

RADIUS_M = 0.002
TOP_M = 0.01
PLATE = {"kind": "plate", "name": "slab", "centre_m": [0.025, 0.0075], "size_m": [0.05, 0.005]}
SLAB: dict[str, Any] = {
    "kind": "polygon",
    "name": "slab",
    "vertices_m": [
        [0.0, 0.005], [0.05, 0.005], [0.05, TOP_M], [0.031, TOP_M], [0.025, TOP_M],
        [0.02, TOP_M], [0.0, TOP_M],
    ],
}  # fmt: skip
"""The same slab as the plate, its top in four edges."""
SHAKE = {"acceleration_g": 3.0, "frequency_hz": 50.0, "duration_s": 0.06, "direction": [0.6, 0.8]}


def one_grain_scene(**changes: object) -> Scenario:
    """Give an empty box of which only the floor matters."""
    base: dict[str, object] = {
        "box": {"width_m": 0.05, "height_m": 0.05},
        "sand": {
            "size_scale": 1.0,
            "size_classes": 1,
            "sieve": [
                {"opening_m": 2 * RADIUS_M / 1.001, "passing_fraction": 0},
                {"opening_m": 2 * RADIUS_M * 1.001, "passing_fraction": 1},
            ],
            "disc_thickness_m": 0.1,
        },
        "fill": {"layers": [{"count": 1}]},
        "background_damping": {"form": "none"},
        "time_step": {"fraction": 0.01},
        "rest": {"load_every_steps": 1, "check_every_s": 1e-4},
        "record": {"series_every_s": 1e-4, "snapshot_every_s": 1e-4},
    }
    return Scenario.model_validate(base | changes)


def slab_scene(obstacle: dict[str, Any], **changes: Any) -> Scenario:
    """One grain over a slab, with a step at which a contact takes some hundred steps."""
    return one_grain_scene(obstacles=[obstacle], **{"time_step": {"fraction": 0.2}} | changes)


def put_grain(session: LammpsSession, place: list[float], speed: list[float]) -> None:
    """Insert the one grain and place it."""
    session.insert_layer(1)
    session.set_state(np.array([place]), np.array([speed]), np.zeros((1, 3)))


def track(session: LammpsSession, windows: int) -> np.ndarray:
    """Place, velocity, spin and load on the slab after each window of the running stage."""
    rows: list[list[float]] = []
    while not session.stage_over and len(rows) < windows:
        session.advance()
        now, loads = session.snapshot(), session.surface_loads()
        if loads is None:  # a stage may end inside a window
            break
        rows.append([*now.position_m[0], *now.velocity_m_s[0], *now.spin_rad_s[0], *loads["slab"]])
    return np.array(rows)
