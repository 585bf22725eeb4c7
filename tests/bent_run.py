"""A run with a pattern as engines leave it: four snapshots and a convergence log, by hand."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd

from sandmould.engines.snapshot import Snapshot
from sandmould.pattern_fe.coupling.convergence_log import CONVERGENCE_LOG
from sandmould.pattern_fe.coupling.foam_body import FoamBody
from sandmould.runs.manifest import save_manifest
from tests.snapshots import write_snapshots

FORCE_N = -0.2
"""On the tip of the flange, downwards."""
WINDOW_S = 0.002
SCENE: dict[str, Any] = {
    "box": {"width_m": 0.15, "height_m": 0.15},
    "pattern": {
        "shape": {"kind": "l_shape", "thickness_m": 0.01, "height_m": 0.06, "reach_m": 0.05},
        "position_m": [0.04, 0.0],
    },
    "vibration": [{"frequency_hz": 50, "acceleration_g": 1.5, "duration_s": 0.02}],
}


def write_bent_run(folder: Path, body: FoamBody, share: float = 1.0) -> None:
    """Drawn, bent by a share of what a load does, the same as vibration begins, bent half as far.

    The convergence log has ten windows a snapshot.
    """
    made = []
    load, bent = tip_load(body)
    one = np.array([1])
    place_m, none = np.array([[0.01, 0.002]]), np.zeros((1, 2))
    moments = [(0.02, np.nan, 0.0), (0.04, np.nan, 1.0), (0.04, 0.0, 1.0), (0.06, 0.02, 0.5)]
    for time_s, shaken_s, part in moments:
        stage = "settle_1" if np.isnan(shaken_s) else "vibrate_1"
        moved_m = body.vertices_m + part * share * bent
        made.append(Snapshot(
            time_s, shaken_s, stage, one, one, place_m, none, np.zeros((1, 3)), np.array([0.002]),
            pattern_m=moved_m, pattern_load_n=load,
        ))  # fmt: skip
    write_snapshots(folder, made)
    write_convergence_log(folder)
    save_manifest(folder, {"cost": {"wall_s": 6.0}})


def tip_load(body: FoamBody) -> tuple[np.ndarray, np.ndarray]:
    load = np.zeros_like(body.vertices_m)
    load[np.argmax(body.vertices_m @ [1.0, 1.0]), 1] = FORCE_N
    return load, body.solve(load).displacement_m


def write_convergence_log(folder: Path) -> None:
    time_s = WINDOW_S * np.arange(1, 31)
    rows = pd.DataFrame(
        {
            "time_s": time_s, "window_s": WINDOW_S, "passes": 2, "factor": 0.02, "gain": np.nan,
            "residual_m": np.where(time_s < 0.041, 2e-4, 1e-4), "displacement_m": 1e-3,
            "largest_m": 2e-3, "load_n": 0.2, "imbalance_n": 2e-12, "moment_left_n_m": 1e-12,
            "work_j": 0.01 * time_s, "energy_j": 0.005 * time_s, "solve_s": 0.01,
        }
    )  # fmt: skip
    rows.to_csv(folder / CONVERGENCE_LOG, sep="\t", index=False)
