"""A box of spheres filled and shaken with the slip in either plane, in pairs of equal starts."""

from __future__ import annotations

from typing import Any

import pandas as pd

from benchmarks.frame.shaken import shaken
from sandmould import ROOT
from sandmould.engines.snapshot import Snapshot
from sandmould.kinds.sand.measure import measure_snapshot
from sandmould.scenario.reading import Origin, merge
from sandmould.scenario.scenario import Scenario
from sandmould.statistics.equivalence import agree
from sandmould.study.plan.expand import expand
from sandmould.study.plan.load_study import open_study

STUDY = ROOT / "config" / "studies" / "tube_3d_small.yaml"
SPRING_N_M = 28e3
"""A fifteenth of what the paper's sand has at this scale, a step four times as long."""
CHANGES: dict[str, Any] = {
    "sand": {"size_classes": 5},
    "contact": {
        law: {f"{which}_stiffness_n_m": SPRING_N_M for which in ("normal", "tangential", "rolling")}
        for law in ("grain_grain", "grain_wall")
    },
    "time_step": {"bed_fraction": 0},
    "vibration": [{"frequency_hz": 50, "acceleration_g": 1.5, "duration_s": 0.2}],
}
PLANES = ("half_step", "full_step")
MARGINS = {
    "solid_fraction": 0.005,
    "tube_fill_fraction": 0.03,
    "coordination_bearing": 0.1,
    "small_grains_height_fraction": 0.02,
}
"""Set before the runs; the first three are those of all studies of a filled box."""


def filled_box(plane: str, seed: int) -> Scenario:
    """The box of tube_3d_small with all five classes of sand, their ends 3.3 apart."""
    base = expand(open_study(STUDY))[0].scenario
    contact = {**CHANGES["contact"], "slip_normal": plane}
    changes = {**CHANGES, "contact": contact, "seed": seed}
    return Scenario.model_validate(
        merge(base.model_dump(exclude_none=True), changes, Origin(), "filled box")
    )


def small_grains_height(snapshot: Snapshot) -> float:
    """Mean height of the smallest class over that of all grains, each weighed by its volume."""
    height, volume = snapshot.position_m[:, -1], snapshot.radius_m**3
    small = snapshot.radius_m < 1.001 * snapshot.radius_m.min()
    return float(height[small].mean() / (height @ volume / volume.sum()))


def box(plane: str, seed: int) -> dict[str, float]:
    """Fill and shake one box, and measure it at rest."""
    scenario = filled_box(plane, seed)
    snapshot = shaken(scenario)
    row = measure_snapshot(scenario, snapshot)
    row["small_grains_height_fraction"] = small_grains_height(snapshot)
    return {name: round(float(row[name]), 6) for name in MARGINS}


def compared(rows: dict[str, list[dict[str, float]]]) -> list[dict[str, Any]]:
    """Judge pairs of boxes, a row a measure."""
    found = []
    for name, margin in MARGINS.items():
        half, full = (pd.Series([row[name] for row in rows[plane]]) for plane in PLANES)
        found.append({"measure": name, "agreed": agree(half, full, margin)})
    return found
